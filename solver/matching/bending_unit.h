// The thin groups of a unit of LaneLayout in a Newton step.
#pragma once

#include <span>
#include <vector>

#include "solver/matching/bending_kernels.h"
#include "solver/matching/bending_shape.h"
#include "solver/matching/sweep_store.h"

namespace sunder {

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
    const BendingArrays<Real>& arrays() const { return arrays_; }

private:
    struct Pull {  // of a group at a member
        Vec3 force, torque;
        Sym3 shift_block, turn_block;  // of the Hessian, times span^2, world
    };
    struct alignas(8 * sizeof(Real)) Record {
        Real numbers[8];
    };
    void put(const SweepInput& input, ParticleIndex g, size_t lane, const BentGroup& group,
             std::span<const BentMember> members);

    const LaneLayout* layout_ = nullptr;
    size_t unit_ = 0;
    uint64_t version_ = 0;
    std::vector<uint32_t> lane_group_;  // that bends, or kNone (by lane)
    std::vector<BendingRow<Real>> rows_;
    std::vector<BendingGroups<Real>> groups_;
    std::vector<uint8_t> is_thin_;
    std::vector<uint32_t> twin_;
    std::vector<BlockDiagonal<Real>> diagonal_;
    std::vector<Record> motion_, pulls_;
    std::vector<Real> cell_torque_;
    std::vector<Pull> pull_;  // by row and lane
    BendingArrays<Real> arrays_ = {};
};

}  // namespace sunder
