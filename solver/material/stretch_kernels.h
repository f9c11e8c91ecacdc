// Optimal rotation and stretch of four groups at a time, from where their particles are.
#pragma once

#include "solver/matching/sweep_kernels.h"

namespace sunder {

/// Groups as they stand.
struct StretchRecords {
    const MovingRecord* moving;                 // (n_particles)
    const double* rotations;                    // optimal rotations to start from, x, y, z, w (n_particles x 4)
    const double* members;                      // MemberShape: q, weight (n_slots x 4)
    const double *masses, *moments;             // of GroupShapes (n_particles, n_particles x 6)
    const double* shapes;                       // GroupShape (n_particles x kShapeNumbers)
    const uint32_t *begin, *end, *member;       // of LiveTopology
    double orientation_weight, stretch_weight;  // of the ellipsoids' part of A_pq
    /// The rotation nearest to A (row by row) where Newton's method may not be trusted.
    void (*exact_rotation)(const double* A, double* rotation);

    // Numbers of a GroupShape, and where V, column by column, and the symmetric ones are.
    static constexpr size_t kShapeNumbers = 45, kV = 2, kLam = 11, kIsotropy = 17;
};

/// Of four groups, side by side.
struct alignas(32) GroupStretches {
    double rotation[4][4];  // R as x, y, z, w
    double S[6][4];         // optimal stretch, Sym3, -
    double deviation[4];    // |S - I|, -
};

/// Principal stretches in ascending order and their directions, column by column.
struct alignas(32) PrincipalLanes {
    double stretch[3][4];
    double directions[9][4];
};

/// F = Q P: a rotation, column by column, and P by its principal stretches, in any order, and their directions.
struct alignas(32) RightFactors {
    double principal[3][4];
    double directions[9][4];
    double Q[9][4];
};

/// No group's bits depend on the three beside it.
struct StretchKernels {
    /// Optimal rotation (Eq. 1) and stretch (Eq. 8) of those groups.
    void (*measure)(const StretchRecords&, const uint32_t (&groups)[4], GroupStretches& o_stretches);
    /// Of the optimal stretch S.
    void (*decompose)(const GroupStretches&, PrincipalLanes& o_principal);
    /// Of V diag(stretch) V^T F_P, V being the directions; where F_P are, column by column.
    void (*factor)(const PrincipalLanes&, const double* const (&plastic_deformation)[4], RightFactors& o_factors);
};

extern const StretchKernels kStretchKernelsPortable, kStretchKernelsAvx2, kStretchKernelsAvx512;

}  // namespace sunder
