// Method jacobi: the implicit Euler equations by averaging, in any order (docs/theory.md, "The implicit step").
#pragma once

#include "solver/matching/sweep_store.h"

namespace sunder {

/// Which sweeps of a correction these are.
struct JacobiIteration {
    int number, of;  // number in [0, of)
    double omega;    // over-relaxation, -
    /// Pieces that something may move between the sweeps (n_pieces); of the others all sweeps are made in the first.
    std::span<const uint8_t> is_touched;
};

class JacobiSweep {
public:
    JacobiSweep();

    /// One sweep over all groups, from the rotations in `io_goals`:
    ///     x <- x + omega [ (x_inertial - x) + sum_g w b_g (goal_g - x) ] / (1 + sum_g w b_g),   rotations likewise.
    /// Held particles stay. In single precision, relative to the piece: a float tells 1 m from 1.0000001 m, wherever
    /// the piece is. Between the first and the last iteration of a correction rest shapes and stiffness must stay as
    /// they are, and rotations as the sweep left them.
    void apply(const JacobiIteration& iteration, const SweepInput& input, const WorkerPool& workers,
               std::span<GroupGoal> io_goals, std::span<MovingParticle> io_particles);

private:
    struct Unit {
        SweepStore<float> store;
        std::vector<JacobiParticles> particles;  // by block
        std::vector<uint32_t> origin;            // where a lane's numbers begin: the first particle of its piece
        bool is_touched = false;                 // one of its pieces is
    };
    void take_up(const SweepInput& input, const WorkerPool& workers);

    const SweepKernels* kernels_;
    LaneLayout layout_;
    std::vector<Unit> units_;
};

}  // namespace sunder
