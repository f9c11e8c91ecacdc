// The thin groups of a unit of LaneLayout in a Newton step.
#pragma once

#include <span>
#include <vector>

#include "solver/matching/bending_kernels.h"
#include "solver/matching/bending_shape.h"
#include "solver/matching/bent_kernels.h"
#include "solver/matching/sweep_store.h"

namespace sunder {

const BentKernels& bent_kernels();
/// What they are to read.
BentRecords bent_records(const BendingShapes& shapes, const LiveTopology& live,
                         std::span<const MovingParticle> particles);
/// Of four groups one.
BentShape bent_shape(const BentGroups& groups, size_t lane);
void bent_members(std::span<const BentRow> rows, size_t lane, std::span<BentMember> o_members);  // r and sigma alone
Unexplained unexplained(const BendingShape& shape, const BentGroups& groups, size_t lane);

/// What a Newton step makes of the thin groups of a unit, where its particles are; kept from the residual to the end of
/// the solve.
template <class Real>
class BendingUnit {
public:
    /// From now on this unit, as it stands; false if no group of it bends.
    bool open(const SweepInput& input, const LaneLayout& layout, size_t unit);

    /// Energy, slope and Hessian of the groups: goal rotations (where not empty), and forces. What flows by the end of
    /// the step is taken off the forces; the Hessian stays elastic, which bounds what is left from above.
    void linearise(const SweepInput& input, std::span<const MovingParticle> particles, const UnitBlocks& blocks,
                   std::span<GroupGoal> io_goals);
    /// Adds the forces to the residuals, and what they are measured by; after gather_residual.
    void add_residual(std::span<NewtonParticles> io_newton, std::span<const CgParticles<Real>> particles,
                      const UnitBlocks& blocks);

    bool bends() const { return !lane_group_.empty(); }
    bool is_all_thin() const { return arrays_.is_all_thin; }
    bool all_pull(size_t block) const { return all_pull_[block] != 0; }  // no group of the block is held or a block
    const BendingArrays<Real>& arrays() const { return arrays_; }
    std::span<const BentPull> pulls() const { return pull_; }  // by row and lane; the last is 0

private:
    struct alignas(8 * sizeof(Real)) Record {
        Real numbers[8];
    };
    struct AtRest {  // what a lane was put with
        uint64_t revision = 0;
        double b = -1;
        bool operator==(const AtRest&) const = default;
    };
    void put_at_rest(const SweepInput& input, size_t lane);
    void linearise_four(const SweepInput& input, const BentRecords& records, size_t lane, std::span<BentRow> io_rows,
                        std::span<GroupGoal> io_goals);

    const BentKernels& kernels_ = bent_kernels();
    const LaneLayout* layout_ = nullptr;
    size_t unit_ = 0;
    uint64_t version_ = 0;
    std::vector<uint32_t> lane_group_;  // that bends, or kNone (by lane)
    std::vector<AtRest> at_rest_;       // by lane
    std::vector<BendingRow<Real>> rows_;
    std::vector<BendingGroups<Real>> groups_;
    std::vector<uint8_t> columns_, all_pull_;  // by block; of spans, 0 where nothing bends
    std::vector<uint32_t> twin_;
    std::vector<BlockDiagonal<Real>> diagonal_;
    std::vector<KeptMotion<Real>> kept_;
    std::vector<Record> motion_, pulls_;
    std::vector<Real> cell_torque_;
    std::vector<BentPull> pull_;  // by row and lane; the last is 0
    BendingArrays<Real> arrays_ = {};
};

}  // namespace sunder
