// The inner loops of the conjugate gradients in NewtonStep: eight groups, or eight particles, at a time, in single
// precision. What rounding leaves undone is in the residual of the next Newton step, which is of double precision.
#pragma once

#include <cstddef>
#include <cstdint>

namespace sunder {

/// Eight particles. Displacements and residuals are shift (m) then turn (rad), divided by the unit's scale.
struct alignas(32) CgParticles {
    float mass[8], inertia[6][8];     // kg; H_j as Sym3, kg m2
    float inverse_diagonal[8];        // 1 / (1 + sum b); 0: held, or padding
    float own_shift[8], own_turn[8];  // 1 + sum w b, 1 + omega sum w b
    float residual[6][8];             // M^-1 (-gradient - H solution)
    float solution[6][8], direction[6][8];
    float product[6][8], image[6][8];  // M^-1 H z of the preconditioned residual z, and of the direction
};

/// Eight groups in a Newton step. R: goal rotation; Q, N, W: GroupShape's isotropy, (I - Q) affine_inverse and
/// volume_gradient.
struct alignas(32) CgGroups {
    float RQ[3][3][8];      // -
    float RW[3][3][8];      // times the root of the pressure term's factor
    float K_inverse[6][8];  // Sym3, 1/(kg m2)
    float N[6][8];          // Sym3, 1/(kg m2)
    float center_scale[8];  // b / M, 1/kg
    float b[8];             // 0: a group that pulls nothing
};

/// A row of LaneLayout. q of the member in the lane's group, and q of the lane's particle in the member's group.
struct alignas(32) CgRow {
    float weight[8];  // w_gj, 0: padding
    float q[3][8], q_other[3][8];
};

struct CgArrays {
    const uint32_t* row_begin;   // of LaneLayout
    const uint32_t* neighbours;  // of LaneLayout
    const CgRow* rows;
    const CgGroups* groups;
    CgParticles* particles;
    float* momentum;    // M z of each lane: m shift, 0, H turn, 0                     (n_lanes x 8)
    float* pulls;       // of each lane's group: b c (3), -b P (9), omega b w (3), 0   (n_lanes x 16)
    double* magnitude;  // of each block: z . M s                                      (n_blocks)
    double* curvature;  // of each block: z . H z                                      (n_blocks)
    float orientation_weight;
};

/// Each works on the blocks [begin, end) and writes there alone.
struct NewtonKernels {
    /// z = s / diagonal: momentum, magnitude.
    void (*precondition)(const CgArrays&, size_t begin, size_t end);
    /// The rigid motion, and the volume strain, that fit z best in each group: pulls.
    void (*fit_groups)(const CgArrays&, size_t begin, size_t end);
    /// Adds M^-1 H z to `product`, which holds zero, or what other terms of H give; then its curvature.
    void (*gather_product)(const CgArrays&, size_t begin, size_t end);
    /// direction = z + beta direction, image likewise; solution += alpha direction, s -= alpha image; product = 0; then
    /// as precondition.
    void (*advance)(const CgArrays&, float alpha, float beta, size_t begin, size_t end);
};

extern const NewtonKernels kNewtonKernelsPortable;
extern const NewtonKernels kNewtonKernelsAvx2;  // only where SUNDER_HAS_AVX2 is defined

}  // namespace sunder
