// Method jacobi: the implicit Euler equations by averaging, in any order ("PD-Jacobi", docs/theory.md).
#pragma once

#include "solver/sweep_store.h"

namespace sunder {

class JacobiSweep {
public:
    JacobiSweep();

    /// One sweep over all groups, from the rotations in `io_goals`:
    ///     x <- x + omega [ (x_inertial - x) + sum_g w b_g (goal_g - x) ] / (1 + sum_g w b_g),   rotations likewise.
    /// Held particles stay. In single precision, relative to the piece.
    void apply(const SweepInput& input, double omega, const WorkerPool& workers, std::span<GroupGoal> io_goals,
               std::span<MovingParticle> io_particles);

private:
    void load_inertial(const SweepInput& input, std::span<const MovingParticle> particles, size_t begin, size_t end);
    void move(const SweepInput& input, std::span<MovingParticle> io_particles, size_t begin, size_t end) const;

    const SweepKernels* kernels_;
    SweepStore<float> store_;
    std::vector<JacobiParticles> particles_;
};

}  // namespace sunder
