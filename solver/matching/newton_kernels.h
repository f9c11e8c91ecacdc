// The inner loops of the conjugate gradients in NewtonStep, a block of eight groups or particles at a time, in single
// or double precision.
#pragma once

#include <cstddef>
#include <cstdint>

namespace sunder {

/// Eight particles: what a Newton step knows of them before its linear solve. Residuals are shift (m) then turn (rad),
/// divided by the unit's scale.
template <class Real>
struct alignas(64) CgParticles {
    Real mass[8], inertia[6][8];             // kg; H_j as Sym3, kg m2
    Real inverse_shift[8], inverse_turn[8];  // 1 / (1 + tether + brace + sum b); 0: held, or padding
    Real own_shift[8], own_turn[8];          // 1 + tether + brace + sum w b, 1 + tether + omega sum w b
    Real residual[6][8];                     // M^-1 (-gradient - H solution)
};

/// The same eight, as long as the solve takes.
template <class Real>
struct alignas(64) CgVectors {
    Real solution[6][8], direction[6][8];
    Real product[6][8], image[6][8];  // M^-1 H z of the preconditioned residual z, and of the direction
};

/// Eight groups in a Newton step. R: goal rotation; Q, N, W: GroupShape's isotropy, N and
/// volume_gradient.
template <class Real>
struct alignas(64) CgGroups {
    Real RQ[3][3][8];      // -
    Real RW[3][3][8];      // times the root of the pressure term's factor
    Real K_inverse[6][8];  // Sym3, 1/(kg m2)
    Real N[6][8];          // Sym3, 1/(kg m2)
    Real center_scale[8];  // b / M, 1/kg
    Real b[8];             // 0: a group that pulls nothing
};

/// A row of LaneLayout. q of the member in the lane's group, and q of the lane's particle in the member's group.
template <class Real>
struct alignas(32) CgRow {
    Real weight[8];  // w_gj, 0: padding
    Real q[3][8], q_other[3][8];
};

template <class Real>
struct BendingArrays;  // solver/matching/bending_kernels.h

template <class Real>
struct CgArrays {
    const uint32_t* row_begin;   // of LaneLayout
    const uint32_t* neighbours;  // of LaneLayout
    const CgRow<Real>* rows;
    const CgGroups<Real>* groups;
    CgParticles<Real>* particles;
    CgVectors<Real>* vectors;
    Real* momentum;     // M z of each lane: m shift, 0, H turn, 0                     (n_lanes x 8)
    Real* pulls;        // of each lane's group: b c (3), -b P (9), omega b w (3), 0   (n_lanes x 16)
    double* magnitude;  // of each block: z . M s                                      (n_blocks)
    double* curvature;  // of each block: z . H z                                      (n_blocks)
    Real orientation_weight;
    const BendingArrays<Real>* bending;  // of a unit with thin groups, else null
};

/// Each works on the blocks [begin, end) and writes there alone. Where groups bend, the diagonal is one of 3x3 blocks.
template <class Real>
struct NewtonKernels {
    /// z = s / diagonal: momentum, magnitude.
    void (*precondition)(const CgArrays<Real>&, size_t begin, size_t end);
    /// The rigid motion, and the volume strain, that fit z best in each group: pulls.
    void (*fit_groups)(const CgArrays<Real>&, size_t begin, size_t end);
    /// Adds M^-1 H z to `product`, which holds zero, or what other terms of H give; then its curvature.
    void (*gather_product)(const CgArrays<Real>&, size_t begin, size_t end);
    /// direction = z + beta direction, image likewise; solution += alpha direction, s -= alpha image; product = 0; then
    /// as precondition.
    void (*advance)(const CgArrays<Real>&, Real alpha, Real beta, size_t begin, size_t end);
};

/// The kernels of an instruction set.
struct CgKernels {
    NewtonKernels<float> single, single_bending;
    NewtonKernels<double> full, full_bending;
};
extern const CgKernels kNewtonKernelsPortable, kNewtonKernelsAvx2, kNewtonKernelsAvx512;

}  // namespace sunder
