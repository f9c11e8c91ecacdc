// What the kernels of shape matching work on, in single or double precision: rest shapes, particles and goals by lane.
#pragma once

#include <span>
#include <vector>

#include "solver/lane_layout.h"
#include "solver/parallel.h"
#include "solver/shape_matching.h"
#include "solver/sweep_kernels.h"

namespace sunder {

struct SweepInput {
    const SimulationMesh& rest;
    const LiveTopology& live;
    const GroupShapes& shapes;
    std::span<const GroupStiffness> stiffness;
    std::span<const Mat3> inertia;  // H_j of the particles' ellipsoids, world, kg m2
    std::span<const uint8_t> held;  // these stay
    std::span<const double> span;   // of the implicit step, of each piece's own, s
};

template <class Real>
class SweepStore {
public:
    // Fewest blocks that a thread is worth waking for; and fewest groups, where most have nothing to do.
    static constexpr size_t kGrain = 32, kTakeUpGrain = 4096;

    /// Rest shapes that changed since they were last taken up; true if the topology did.
    bool take_up(const SweepInput& input, const WorkerPool& workers);

    /// Stiffness, rotations to start from and particles, of the blocks [begin, end).
    void load(const SweepInput& input, std::span<const MovingParticle> particles, std::span<const GroupGoal> goals,
              size_t begin, size_t end);

    /// Rotations of the groups of blocks [begin, end).
    void give_rotations(std::span<GroupGoal> io_goals, size_t begin, size_t end) const;

    SweepArrays<Real> arrays();
    const LaneLayout& layout() const { return layout_; }

private:
    void take_up_group(const SweepInput& input, uint32_t g);

    LaneLayout layout_;
    std::vector<uint64_t> revision_;  // of each group's shape as taken up (n_particles)
    struct Bound {
        double elastic, pressure;  // of a goal's pull on a member over b; the latter for a volume ratio of 1
    };
    std::vector<Bound> bounds_;  // by lane
    std::vector<SweepRow<Real>> rows_;
    std::vector<SweepGroups<Real>> groups_;
    std::vector<SweepParticle<Real>> particles_;
    std::vector<SweepGoal<Real>> goals_;
};

/// Where lanes of single precision have their origin: the first particle of the piece, for a float tells 1 m from
/// 1.0000001 m, wherever the piece is.
inline const Vec3& piece_origin(const LiveTopology& live, std::span<const MovingParticle> particles, uint32_t j) {
    return particles[live.piece_particles(live.piece(j)).front()].x;
}

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
