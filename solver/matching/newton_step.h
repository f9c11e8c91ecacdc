// A Newton step of the implicit Euler equations: all particles of a piece move together, rotations included, so that
// stiff bodies have their true stiffness after one or two steps where sweeps would need hundreds.
#pragma once

#include <span>
#include <vector>

#include "solver/matching/bending_unit.h"
#include "solver/matching/conjugate_gradients.h"

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
///
/// Thin groups (bending_shape.h) are none of these: their forces are added to the residual, their products to H d
/// (bending_kernels.h), and where a unit has some the diagonal is one of 3x3 blocks.
///
/// Units are gone through twice: residuals first, for what a unit is solved to depends on those of all. Each time a
/// thread expands the rest shapes of the unit that it works on into memory of its own; where there are so few that all
/// of them find room, they stay expanded.
class NewtonStep {
public:
    NewtonStep();

    /// Moves the particles by the step, each piece as far as StepLimit permits. Later iterations of a substep do no
    /// more than contacts and turning left to do. `io_goals`: rotations to start from.
    void apply(bool first_iteration, const SweepInput& input, const WorkerPool& workers, std::span<GroupGoal> io_goals,
               std::span<MovingParticle> io_particles);

    /// The step of velocities v (`io_shift`, m/s; `io_turn`, rad/s) under the damping of stiffness alone: H v' = M v, b
    /// being span^2 k. Leaves v' - v in them.
    void damp(const SweepInput& input, const WorkerPool& workers, std::span<GroupGoal> io_goals,
              std::span<const MovingParticle> particles, std::span<Vec3> io_shift, std::span<Vec3> io_turn);

private:
    template <class Real>
    struct Precision {
        ConjugateGradients<Real> gradients;
        std::vector<CgStore<Real>> stores;       // as store_of
        std::vector<BendingUnit<Real>> bending;  // by unit
    };
    // Particles as a thread works on a unit.
    struct Scratch {
        std::vector<NewtonParticles> particles;   // by block
        std::vector<EllipsoidRecord> ellipsoids;  // by lane
        std::vector<Quat> turned;                 // as the step would have them, by lane
    };

    template <class Real>
    UnitKernels<Real> kernels_of(const Precision<Real>& precision, size_t unit) const;
    size_t n_stores(const WorkerPool& workers) const;
    size_t store_of(size_t unit, size_t slot) const;
    /// True if conjugate gradients need double precision.
    bool take_up(const SweepInput& input, const WorkerPool& workers);
    // Goal rotations, and the residual and diagonal of the implicit step; `change` may make it another residual.
    template <class Real, class Change>
    void find_residuals(Precision<Real>& precision, bool first_iteration, const SweepInput& input,
                        const WorkerPool& workers, std::span<GroupGoal> io_goals,
                        std::span<const MovingParticle> particles, const Change& change);
    // Calls move(unit, slot, blocks, for_free) for every unit that moves; for_free(blocks, body) calls
    // body(lane, particle, shift, turn) for all of it that is not held.
    template <class Real, class Move>
    void solve(Precision<Real>& precision, const SweepInput& input, const WorkerPool& workers, const Move& move);
    template <class Real>
    void damp_in(Precision<Real>& precision, const SweepInput& input, const WorkerPool& workers,
                 std::span<GroupGoal> io_goals, std::span<const MovingParticle> particles, std::span<Vec3> io_shift,
                 std::span<Vec3> io_turn);
    template <class Real>
    void apply_in(Precision<Real>& precision, bool first_iteration, const SweepInput& input, const WorkerPool& workers,
                  std::span<GroupGoal> io_goals, std::span<MovingParticle> io_particles);
    bool moves(const SweepInput& input, const LaneLayout::Unit& unit) const;  // a particle of it is free
    double mean_residual() const;

    const SweepKernels* sweep_kernels_;
    const CgKernels* cg_kernels_;
    LaneLayout layout_;
    std::vector<SweepStore<double>> stores_;  // as store_of
    std::vector<Scratch> scratch_;            // by slot
    std::vector<UnitResidual> residual_;      // by unit
    std::vector<uint32_t> no_rows_;           // as LaneLayout's, of blocks that have none
    struct BlockResidual {
        double magnitude, size;  // as NewtonParticles
    };
    std::vector<BlockResidual> block_residual_;
    Precision<float> single_;
    Precision<double> full_;
};

}  // namespace sunder
