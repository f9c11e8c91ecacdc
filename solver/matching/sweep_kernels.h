// The inner loops of shape matching: the groups' goals from where the particles are, and the averaging of method
// jacobi. Eight lanes of LaneLayout a block, in single or double precision.
#pragma once

#include <cstddef>
#include <cstdint>

#include "solver/data/role.h"
#include "solver/matching/newton_kernels.h"

namespace sunder {

/// A row of LaneLayout: the member in the lane's group, and its q_other: q of the lane's particle in the member's
/// group. In double precision what its ellipsoid adds to A_pq is gathered with its inertia (EllipsoidRecord); in
/// single, where nothing else is gathered of it, its moment lies in the row.
template <class Real>
struct alignas(64) SweepRow {
    Real weight[8];  // w_gj, 0: padding
    Real q[3][8], q_other[3][8];
};
template <>
struct alignas(64) SweepRow<float> {
    float weight[8];
    float q[3][8], q_other[3][8];
    float moment[6][8];  // w_gj M_j, Sym3, kg m2
};

/// Eight groups: GroupShape's, as Sym3 where they are symmetric, and what the step makes of their stiffness.
template <class Real>
struct alignas(64) SweepGroups {
    Real inverse_mass[8];                                // 1/kg; 0: padding
    Real isotropy[6][8], N[6][8];                        // Q; (I - Q) A^+, 1/(kg m2)
    Real stiffness_moment[6][8], volume_gradient[6][8];  // kg m2; 1/(kg m2)
    Real volume_rest[8], spread[8];                      // -; trace / 3, kg m2
    Real b[8], bound[8], volume_ratio[8];                // span^2 k, with what bounds the pull; lambda / (2 mu)
    Real rotation[4][8];                                 // R as x, y, z, w: warm start, then the result
};

/// Of each lane; x relative to the piece's origin in single precision.
template <class Real>
struct SweepParticle;
template <>
struct alignas(32) SweepParticle<float> {
    float x[3] = {}, mass = 0, d[4] = {0, 0, 0, 1};  // m; kg; rotation since rest as x, y, z, w
};
template <>
struct alignas(32) SweepParticle<double> {
    double x[3] = {}, mass = 0;  // m; kg
};
template <class Real>
struct alignas(16) SweepGoal {
    Real center[3], G[9], rotation[4], b, bound, unused[2];
};

/// What groups gather of their members' ellipsoids in a Newton step.
struct alignas(64) EllipsoidRecord {
    double DM[9], H[6], unused;  // moment, turned on one side, row by row; inertia as it is turned, Sym3; kg m2
};

/// Of a unit of LaneLayout.
template <class Real>
struct SweepArrays {
    const uint32_t* row_begin;   // of LaneLayout
    const uint32_t* neighbours;  // of LaneLayout
    const SweepRow<Real>* rows;
    SweepGroups<Real>* groups;
    const SweepParticle<Real>* particles;
    SweepGoal<Real>* goals;
    const EllipsoidRecord* ellipsoids;  // of the lanes, for match_for_newton
    // One of these is written by match_for_newton, the other null:
    CgGroups<float>* newton;
    CgGroups<double>* newton_full;
    double orientation_weight;
    /// The rotation nearest to A (row by row) where Newton's method may not be trusted.
    void (*exact_rotation)(const double* A, double* rotation);
};

/// Eight particles in method jacobi.
struct alignas(64) JacobiParticles {
    float x_inertial[3][8], d_inertial[4][8];  // as SweepParticle
    float free[8];                             // 0: held, or padding
    float x_moved[3][8];                       // result: by all sweeps since they were taken in, m
};

/// A MovingParticle, for those who know no vectors.
struct MovingRecord {
    double x[3], unused, d[4], x_inertial[3], unused_too, d_inertial[4];  // quaternions x, y, z, w
};

/// Particles as the substep has them, and which of them the lanes of a unit are.
struct JacobiRecords {
    MovingRecord* moving;      // (n_particles)
    double* rotations;         // of their groups, x, y, z, w (n_particles x 4)
    const Role* role;          // (n_particles)
    const uint32_t* particle;  // of each lane; kNone: padding
    const uint32_t* origin;    // first particle of its piece; of each lane, likewise
};

/// Eight particles in a Newton step.
struct alignas(64) NewtonParticles {
    double x[3][8], d[4][8], x_inertial[3][8], d_inertial[4][8];
    double mass[8], inertia[6][8], free[8];  // kg; Sym3, kg m2; 0: held, or padding
    double free_turn[8];                     // likewise
    double brace[8], tether[8];              // masses
    double residual[6][8];                   // result: M^-1 times minus the gradient, m and rad
    double magnitude, size;  // of the block: residual . M residual / diagonal; sum of traces of A_qq; kg m2
    double way;              // as magnitude, of what inertia alone would move it by; where something bends
};

/// Rest shapes as GroupShapes keeps them, and whose they are.
struct ShapeRecords {
    static constexpr size_t kNumbers = 4;         // of a member: q, weight
    const double* members;                        // (n_slots x 4)
    const double* moments;                        // M_j of the particles' ellipsoids (n_particles x 6)
    const uint32_t *begin, *end, *twin, *member;  // of LiveTopology
    const uint32_t* particle;                     // of the unit's lanes
};

/// What a Newton step takes in of the particles, and which of them the lanes of a unit are.
struct NewtonRecords {
    const MovingRecord* moving;  // (n_particles)
    const double* moments;       // M_j of the ellipsoids (n_particles x 6)
    const double* masses;        // (n_particles)
    const Role* role;            // (n_particles)
    const double* brace;         // (n_particles), or null: 0
    const double* tether;        // (n_particles), or null: 0
    const uint32_t* particle;    // of each lane; kNone: padding
};

struct SweepKernels {
    /// Writes the rows of the blocks [begin, end).
    void (*expand)(const ShapeRecords&, const uint32_t* row_begin, SweepRow<float>*, size_t begin, size_t end);
    void (*expand_full)(const ShapeRecords&, const uint32_t* row_begin, SweepRow<double>*, size_t begin, size_t end);
    void (*expand_for_gradients)(const ShapeRecords&, const uint32_t* row_begin, CgRow<float>*, size_t begin,
                                 size_t end);
    void (*expand_for_gradients_full)(const ShapeRecords&, const uint32_t* row_begin, CgRow<double>*, size_t begin,
                                      size_t end);
    /// Where particles are and where inertia takes them.
    void (*take_in)(const JacobiRecords&, SweepParticle<float>*, JacobiParticles*, size_t begin, size_t end);
    void (*match)(const SweepArrays<float>&, size_t begin, size_t end);
    /// Moves the particles of the arrays that are free.
    void (*average)(const SweepArrays<float>&, SweepParticle<float>*, JacobiParticles*, float omega, size_t begin,
                    size_t end);
    /// Writes what sweeps did to particles that are free, and the groups' rotations, as units of double precision;
    /// these stay in the lanes, too.
    void (*give_back)(const JacobiRecords&, const SweepParticle<float>*, const JacobiParticles*, SweepGroups<float>*,
                      size_t begin, size_t end);
    /// Particles as they are; H is their inertia as they are turned now.
    void (*take_in_for_newton)(const NewtonRecords&, NewtonParticles*, SweepParticle<double>*, EllipsoidRecord*,
                               size_t begin, size_t end);
    void (*match_for_newton)(const SweepArrays<double>&, size_t begin, size_t end);
    /// Minus the gradient of the implicit Euler step, and the diagonal of H.
    void (*gather_residual)(const SweepArrays<double>&, NewtonParticles*, CgParticles<float>*, size_t begin,
                            size_t end);
    void (*gather_residual_full)(const SweepArrays<double>&, NewtonParticles*, CgParticles<double>*, size_t begin,
                                 size_t end);
};

extern const SweepKernels kSweepKernelsPortable, kSweepKernelsAvx2, kSweepKernelsAvx512;

}  // namespace sunder
