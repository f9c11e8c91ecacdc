// What the kernels of shape matching work on, in single or double precision: rest shapes, particles and goals by lane.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "solver/matching/shape_matching.h"
#include "solver/matching/shape_watch.h"
#include "solver/matching/sweep_kernels.h"

namespace sunder {

constexpr uint32_t kLanes = LaneLayout::kLanes;

class BendingShapes;
struct FlowWithin;

struct SweepInput {
    const SimulationMesh& rest;
    const LiveTopology& live;
    const GroupShapes& shapes;
    std::span<const GroupStiffness> stiffness;
    std::span<const Role> role;    // (n_particles)
    std::span<const double> span;  // of the implicit step, of each piece's own, s
    // Of Newton steps: how hard, times its mass, a particle is kept where contacts left it; or empty: nothing is.
    std::span<const double> brace = {};
    // Of Newton steps: the stiffness that draws a particle to where inertia takes it, beside that of its inertia (as is
    // that of its turns); or empty: none.
    std::span<const double> tether = {};
    const BendingShapes* bending = nullptr;  // of thin groups, which shape matching leaves alone; null: there are none
    const FlowWithin* flow = nullptr;        // of thin groups, what flows by the end of the step; null: nothing does
    bool is_first = false;                   // Newton step of a substep: what is loaded is not yet strained by it
};

/// One unit of a layout; blocks and lanes are counted from its first.
template <class Real>
class SweepStore {
public:
    /// From now on this unit, as it stands. What a store held of the same unit, and did not change, it keeps.
    void open(const SweepInput& input, const LaneLayout& layout, size_t unit, const UnitBlocks& blocks);
    /// Rest shapes of the blocks [begin, end), as far as they changed.
    void take_up(const SweepInput& input, const SweepKernels& kernels, size_t begin, size_t end);

    /// Stiffness, rotations to start from, and, in single precision, masses, of the blocks [begin, end); in double,
    /// masses come with where particles are (take_in_for_newton).
    void load(const SweepInput& input, std::span<const GroupGoal> goals, size_t begin, size_t end);

    /// Rotations of the groups of blocks [begin, end).
    void give_rotations(std::span<GroupGoal> io_goals, size_t begin, size_t end) const;

    SweepArrays<Real> arrays();
    SweepParticle<Real>* particles() { return particles_.data(); }                         // by lane
    const uint32_t* lane_particles() const { return numbers(watch_.particles()).data(); }  // as LaneLayout::particle

private:
    ParticleId particle(size_t lane) const { return watch_.particles()[lane]; }
    void take_up_group(const GroupShape& shape, size_t lane);

    ShapeWatch watch_;
    struct Bound {
        double elastic, pressure;  // of a goal's pull on a member over b; the latter for a volume ratio of 1
    };
    std::vector<Bound> bounds_;  // by lane
    std::vector<SweepRow<Real>> rows_;
    std::vector<SweepGroups<Real>> groups_;
    std::vector<SweepParticle<Real>> particles_;
    std::vector<SweepGoal<Real>> goals_;
};

/// For those who know no vectors.
inline const MovingRecord* moving_records(std::span<const MovingParticle> particles) {
    static_assert(sizeof(MovingParticle) == sizeof(MovingRecord));
    static_assert(offsetof(MovingParticle, d) == offsetof(MovingRecord, d) &&
                  offsetof(MovingParticle, x_inertial) == offsetof(MovingRecord, x_inertial) &&
                  offsetof(MovingParticle, d_inertial) == offsetof(MovingRecord, d_inertial));
    return reinterpret_cast<const MovingRecord*>(particles.data());
}
inline MovingRecord* moving_records(std::span<MovingParticle> particles) {
    return const_cast<MovingRecord*>(moving_records(std::span<const MovingParticle>(particles)));
}

/// Of the lanes of the unit that is watched.
ShapeRecords shape_records(const SweepInput& input, const ShapeWatch& watch);

// Into one lane of a block's arrays.
template <class Real>
void put_lane(const Vec3& v, size_t lane, Real (*to)[8]) {
    for (int i = 0; i < 3; ++i) to[i][lane] = static_cast<Real>(v(i));
}
template <class Real>
void put_lane(const Quat& q, size_t lane, Real (*to)[8]) {
    for (int i = 0; i < 4; ++i) to[i][lane] = static_cast<Real>(q.coeffs()(i));
}
template <class Real>
void put_lane(const Sym3& m, size_t lane, Real (*to)[8]) {
    for (size_t i = 0; i < 6; ++i) to[i][lane] = static_cast<Real>(m[i]);
}

}  // namespace sunder
