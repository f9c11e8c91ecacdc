// A Newton step of the implicit Euler equations: all particles of a piece move together, rotations included, so that
// stiff bodies have their true stiffness after one or two steps where sweeps would need hundreds.
#pragma once

#include <span>
#include <vector>

#include "solver/lane_layout.h"
#include "solver/newton_kernels.h"
#include "solver/parallel.h"
#include "solver/shape_matching.h"

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
/// The gradient and the particles are of double precision, the conjugate gradients of single: what they lose is left in
/// the next gradient. Their products are with M^-1 H, so that masses and inertias come in once a particle.
class NewtonStep {
public:
    static constexpr int kMaxIterations = 60;    // of conjugate gradients; a bar of 2560 particles at 2 MPa takes 40
    static constexpr double kTolerance = 0.003;  // of the preconditioned residual at the start of the substep

    struct Input {
        const SimulationMesh& rest;
        const LiveTopology& live;
        const GroupShapes& shapes;
        std::span<const GroupStiffness> stiffness;
        std::span<const GroupGoal> goals;  // of the present particles (match_groups)
        std::span<const Mat3> inertia;     // H_j of the particles' ellipsoids, world, kg m2
        std::span<const uint8_t> held;     // these stay
    };

    NewtonStep();

    /// Moves the particles by the step. Later iterations of a substep do no more than contacts and turning left to do.
    void apply(bool first_iteration, const Input& input, const WorkerPool& workers,
               std::span<MovingParticle> io_particles);

private:
    // Of a block, in double precision.
    struct Block {
        double residual[6][8];  // M^-1 times minus the gradient
        double magnitude = 0;   // residual . M residual / diagonal, kg m2
        double size = 0;        // sum of the groups' traces of A_qq, kg m2
    };
    struct alignas(64) Pull {
        float numbers[16];
    };
    struct alignas(32) Momentum {
        float numbers[8];
    };

    void take_up_shapes(const Input& input, bool all, size_t begin, size_t end);
    void prepare_groups(const Input& input, size_t begin_block, size_t end_block);
    void gather_residual(const Input& input, std::span<const MovingParticle> particles, size_t begin_block,
                         size_t end_block);
    template <class ForBlocks>
    void solve_unit(bool first_iteration, size_t unit, const ForBlocks& for_blocks);
    void solve(bool first_iteration, const WorkerPool& workers);
    void move(std::span<MovingParticle> io_particles, size_t begin_block, size_t end_block) const;

    const NewtonKernels* kernels_;
    LaneLayout layout_;
    std::vector<uint64_t> packed_;  // revision of each group's shape in rows_ and groups_ (n_particles)
    std::vector<CgRow> rows_;
    std::vector<CgGroups> groups_;
    std::vector<CgParticles> particles_;
    std::vector<Momentum> momentum_;
    std::vector<Pull> pulls_;
    std::vector<double> magnitude_, curvature_;
    std::vector<Block> blocks_;
    std::vector<double> unit_scale_;  // of the particles' floats: residual and solution are multiplied by it
    std::vector<double> reference_;   // squared residual of each unit at the start of the substep, kg m2
};

}  // namespace sunder
