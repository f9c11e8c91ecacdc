// A Newton step of the implicit Euler equations: all particles of a piece move together, rotations included, so that
// stiff bodies have their true stiffness after one or two steps where sweeps would need hundreds.
#pragma once

#include <span>
#include <vector>

#include "solver/conjugate_gradients.h"

namespace sunder {

/// Solves H d = -gradient by conjugate gradients, matrix-free over the groups, every unit of LaneLayout by itself. A
/// group with goal rotation R pulls its members towards the rigid motion that fits theirs best (centre c and turn w
/// about it):
///
///     H d at member j:   b m_j ( d_j - c - w x R q_j )      and   b H_j ( turn_j - w ),
///     c = sum m_j d_j / M,   w = K^-1 sum ( m_j R q_j x d_j + H_j turn_j ),   K = inertia of the group in its goal
///     shape
///
/// with masses and inertias weighted as in GroupShapes, plus m_j d_j and H_j turn_j for inertia, plus the pressure
/// term. K of the goal shape, not of the present one, keeps H positive definite in any deformation.
///
/// The gradient and the particles are of double precision, the conjugate gradients of single where that tells b from
/// b + 1: what they lose is left in the next gradient. Their products are with M^-1 H, so that masses and inertias come
/// in once a particle.
class NewtonStep {
public:
    NewtonStep();

    /// Moves the particles by the step. Later iterations of a substep do no more than contacts and turning left to do.
    /// `io_goals`: rotations to start from.
    void apply(bool first_iteration, const SweepInput& input, const WorkerPool& workers, std::span<GroupGoal> io_goals,
               std::span<MovingParticle> io_particles);

    /// The step of velocities v (`io_shift`, m/s; `io_turn`, rad/s) under the damping of stiffness alone: H v' = M v, b
    /// being span^2 k. Leaves v' - v in them.
    void damp(const SweepInput& input, const WorkerPool& workers, std::span<GroupGoal> io_goals,
              std::span<const MovingParticle> particles, std::span<Vec3> io_shift, std::span<Vec3> io_turn);

private:
    /// True if conjugate gradients need double precision.
    bool take_up(const SweepInput& input, const WorkerPool& workers);
    // Particles, goal rotations, and the residual and diagonal of the implicit step.
    template <class Real>
    void prepare(ConjugateGradients<Real>& gradients, const SweepInput& input, const WorkerPool& workers,
                 std::span<GroupGoal> io_goals, std::span<const MovingParticle> particles);
    template <class Real>
    void damp_in(ConjugateGradients<Real>& gradients, const NewtonKernels<Real>& kernels, const SweepInput& input,
                 const WorkerPool& workers, std::span<GroupGoal> io_goals, std::span<const MovingParticle> particles,
                 std::span<Vec3> io_shift, std::span<Vec3> io_turn);
    template <class Real>
    void apply_in(ConjugateGradients<Real>& gradients, const NewtonKernels<Real>& kernels, bool first_iteration,
                  const SweepInput& input, const WorkerPool& workers, std::span<GroupGoal> io_goals,
                  std::span<MovingParticle> io_particles);
    void load(const SweepInput& input, std::span<const MovingParticle> particles, size_t begin_block, size_t end_block);

    const SweepKernels* sweep_kernels_;
    const CgKernels* cg_kernels_;
    SweepStore<double> store_;
    std::vector<NewtonParticles> newton_;  // by block
    std::vector<InertiaRecord> inertia_;   // by lane
    std::vector<double> reference_;        // squared residual of each unit at the start of the substep, kg m2
    ConjugateGradients<float> single_;
    ConjugateGradients<double> full_;
};

}  // namespace sunder
