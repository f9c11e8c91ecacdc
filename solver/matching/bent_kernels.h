// Thin groups as their particles lie, four side by side, and what a Newton step makes of them: bend and pull_back of
// bending_shape.h, which are what these are tested against.
#pragma once

#include <cstddef>
#include <cstdint>

#include "solver/matching/sweep_kernels.h"

namespace sunder {

template <class Real>
struct BendingRow;
template <class Real>
struct BendingGroups;
template <class Real>
struct BlockDiagonal;

/// Strain that grows through a fragment: what is bent changes its thickness by no more, -.
inline constexpr double kMostDrawn = 0.25;

/// Groups at rest, and where particles are.
struct BentRecords {
    const MovingRecord* moving;            // (n_particles)
    const double* members;                 // BendingMember (n_slots x kMember)
    const double* shapes;                  // BendingShape (n_particles x kShape)
    const uint32_t *begin, *end, *member;  // of LiveTopology
    /// The rotation nearest to A (row by row) where Newton's method may not be trusted.
    void (*exact_rotation)(const double* A, double* rotation);
    /// Arc, of whatever turn: place, then the rate row by row.
    void (*exact_arc)(const double* turn, const double* q, double* arc);

    // Numbers of a BendingMember, and where some of them are.
    static constexpr size_t kMember = 35, kShiftBlock = 23, kTurnBlock = 29;
    // The same of a BendingShape.
    static constexpr size_t kFlags = 12;  // two bytes
    static constexpr size_t kShape = 249, kAxes = 2, kExtent = 11, kVolume = 14, kMu = 15, kK = 17, kSoftness = 19,
                            kTurnMoment = 22, kShear = 25, kSpanned = 28, kBending = 55, kPlasticCurvature = 217,
                            kSpan = 229, kLambda = 247, kThinning = 248;
};

/// Four groups, as BentGroup. Matrices row by row.
struct alignas(32) BentGroups {
    double axes[3][3][4], K[3][3][4], F[3][3][4], R[3][3][4];
    double rotation[4][4];                         // the goal, since rest in the world, x, y, z, w
    double shift_square[3][4], turn_square[3][4];  // sum of w m r X r and w m sigma Gamma sigma, by axes, kg m2
};

/// A member of each, as BentMember, with what BendingMember says of it.
struct alignas(32) BentRow {
    double weight[4], mean_part[4];  // 0: not there
    double q[3][4], pull[3][4], arm[3][4], pull_arm[3][4], own_turn[3][4];
    double p[3][4], turn[3][4], r[3][4], sigma[3][4];
    double turn_rate[3][3][4], arc_rate[3][3][4];
};

/// What of them flows by the end of a step, as Yielding.
struct alignas(32) YieldingGroups {
    double stretch[3][3][4], K[3][3][4];
    double shift_left[3][4], turn_left[3][4];
};

/// What a group does to a member, times span^2, in the world.
struct alignas(32) BentPull {
    double force[3], torque[3];            // N s2, N m s2
    double shift_block[6], turn_block[6];  // of the Hessian, Sym3
    double unused[2];
};

/// Where a Newton step has four groups: lanes [lane, lane + 4) of a block.
template <class Real>
struct BentLanes {
    BendingGroups<Real>& groups;
    BendingRow<Real>* rows;  // of the block (n_rows)
    BentPull* pulls;         // of the block (n_rows x 8)
    size_t lane;
    bool knows_stress;  // as it is, and not as straight ways strain what turns
};

/// No group's bits depend on the three beside it.
struct BentKernels {
    /// Rows: as many as the largest of the groups has members, at least; their rates only where `with_rates`.
    void (*bend)(const BentRecords&, const uint32_t (&groups)[4], size_t n_rows, bool with_rates, BentGroups& o_groups,
                 BentRow* o_rows);
    /// What the particles' places make of a Newton step's groups: forces, without what `yielding` (or null) takes of
    /// elastic strain, and Hessian. `b`: span^2; 0: a lane whose group does not count.
    void (*linearise)(const BentRecords&, const uint32_t (&groups)[4], const double (&b)[4], size_t n_rows,
                      const BentGroups&, const BentRow*, const YieldingGroups*, const BentLanes<float>&);
    void (*linearise_full)(const BentRecords&, const uint32_t (&groups)[4], const double (&b)[4], size_t n_rows,
                           const BentGroups&, const BentRow*, const YieldingGroups*, const BentLanes<double>&);
    /// Adds what the groups do to the particles of a block to their residual, and finds its diagonal. `twin`: of each
    /// row and lane, which of the pulls is the particle's (n_rows x 8).
    void (*add_pulls)(const BentPull* pulls, const uint32_t* twin, size_t n_rows, const CgParticles<float>&,
                      NewtonParticles& io_particles, BlockDiagonal<float>& o_diagonal);
    void (*add_pulls_full)(const BentPull* pulls, const uint32_t* twin, size_t n_rows, const CgParticles<double>&,
                           NewtonParticles& io_particles, BlockDiagonal<double>& o_diagonal);
};

extern const BentKernels kBentKernelsPortable, kBentKernelsAvx2, kBentKernelsAvx512;

}  // namespace sunder
