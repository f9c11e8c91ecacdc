// Compiled once for each instruction set (lanes.h).
#include "solver/matching/sweep_kernels.h"

#include "solver/lanes/lane_rotation.h"
#include "solver/matching/lane_copies.h"

namespace sunder {
namespace {

template <class Real>
struct Precision;
template <>
struct Precision<float> {
    using Lanes = Float8;
    static constexpr size_t kLanes = 8;
    static constexpr int kMaxIterations = 8;
    static constexpr float kConverged = 1e-7f;
    static constexpr float kProperMaximum[3] = {1e-6f, 1e-6f, 1e-6f};
};
template <>
struct Precision<double> {  // as optimal_rotation
    using Lanes = Doubles;
    static constexpr size_t kLanes = sizeof(Doubles) / sizeof(double);
    static constexpr int kMaxIterations = 12;
    static constexpr double kConverged = 1e-14;
    static constexpr double kProperMaximum[3] = {1e-9, 1e-12, 1e-15};
};

// optimal_rotation of polar_decomposition.cpp, lane by lane; q: warm start, then the result. A lane that has converged
// stays as it is, so that what else is in the block does not matter.
template <class Real, class V>
SUNDER_INLINE void optimal_rotation(V (&A)[3][3], V (&q)[4], void (*exact)(const double*, double*)) {
    using P = Precision<Real>;
    const V zero = {}, one = zero + Real(1), scale = root(contract(A, A));
    Mask<V> active = zero < scale, lost = zero < zero;
    const V unit_scale = one / select<V>(active, scale, one);  // products of three must not leave a float's range
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) A[r][c] = unit_scale * A[r][c];
    for (int iteration = 0; iteration < P::kMaxIterations && any(active); ++iteration) {
        V R[3][3], B[3][3];
        rotation_matrix(q, R);
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) B[r][c] = R[0][r] * A[0][c] + R[1][r] * A[1][c] + R[2][r] * A[2][c];
        // Gradient of tr(R^T A) for R <- R exp([w]x), and (minus) its Hessian.
        const V gx = B[2][1] - B[1][2], gy = B[0][2] - B[2][0], gz = B[1][0] - B[0][1];
        const V xx = B[1][1] + B[2][2], yy = B[0][0] + B[2][2], zz = B[0][0] + B[1][1];
        const V xy = Real(-0.5) * (B[0][1] + B[1][0]), xz = Real(-0.5) * (B[0][2] + B[2][0]),
                yz = Real(-0.5) * (B[1][2] + B[2][1]);
        // Adjugate and leading minors: positive definite exactly when all three minors are positive.
        const V c00 = yy * zz - yz * yz, c01 = xz * yz - xy * zz, c02 = xy * yz - xz * yy;
        const V c11 = xx * zz - xz * xz, c12 = xy * xz - xx * yz, c22 = xx * yy - xy * xy;
        const V det = xx * c00 + xy * c01 + xz * c02;
        const Mask<V> proper = (zero + P::kProperMaximum[0] < xx) & (zero + P::kProperMaximum[1] < c22) &
                               (zero + P::kProperMaximum[2] < det);
        const V half = Real(0.5) / det;  // of half the turn: w / 2
        const V wx = half * (c00 * gx + c01 * gy + c02 * gz), wy = half * (c01 * gx + c11 * gy + c12 * gz),
                wz = half * (c02 * gx + c12 * gy + c22 * gz);
        const V step = Real(4) * (wx * wx + wy * wy + wz * wz);
        // Half a radian and more: not a warm start. Cayley map of w: second order like the exponential.
        const Mask<V> good = proper & (step < one);
        lost = lost | (active & ~good);
        active = active & good;
        const V x = q[0] + (q[3] * wx + (q[1] * wz - q[2] * wy)), y = q[1] + (q[3] * wy + (q[2] * wx - q[0] * wz));
        const V z = q[2] + (q[3] * wz + (q[0] * wy - q[1] * wx)), w = q[3] - (q[0] * wx + q[1] * wy + q[2] * wz);
        const V unit = one / root(x * x + y * y + z * z + w * w);
        q[0] = select<V>(active, unit * x, q[0]), q[1] = select<V>(active, unit * y, q[1]);
        q[2] = select<V>(active, unit * z, q[2]), q[3] = select<V>(active, unit * w, q[3]);
        active = active & ~(step < (zero + P::kConverged));
    }
    lost = lost | active;
    if (!any(lost)) return;
    Real a[9][P::kLanes], rotation[4][P::kLanes], is_lost[P::kLanes];
    for (int i = 0; i < 9; ++i) store(a[i], A[i / 3][i % 3]);
    for (int i = 0; i < 4; ++i) store(rotation[i], q[i]);
    store(is_lost, select<V>(lost, one, zero));
    for (size_t lane = 0; lane < P::kLanes; ++lane) {
        if (is_lost[lane] == 0) continue;
        double matrix[9], result[4];
        for (int i = 0; i < 9; ++i) matrix[i] = static_cast<double>(a[i][lane]);
        exact(matrix, result);
        for (int i = 0; i < 4; ++i) rotation[i][lane] = static_cast<Real>(result[i]);
    }
    for (int i = 0; i < 4; ++i) q[i] = load<V>(rotation[i]);
}

// What the conjugate gradients need of a group: K = tr(A) I - A + sum of inertias, A = R S R^T.
template <class Real>
SUNDER_INLINE void put_newton(const SweepGroups<double>& g, size_t lane, const Doubles (&R)[3][3],
                              const Doubles (&RQ)[3][3], const Doubles (&RW)[3][3], Sym<Doubles> K,
                              CgGroups<Real>& to) {
    const Doubles pressure = root(load<Doubles>(g.volume_ratio + lane) * load<Doubles>(g.spread + lane));
    Doubles RS[3][3];
    multiply(R, sym<Doubles>(g.stiffness_moment, lane), RS);
    const auto entry = [&](int r, int c) { return RS[r][0] * R[c][0] + RS[r][1] * R[c][1] + RS[r][2] * R[c][2]; };
    const Doubles xx = entry(0, 0), yy = entry(1, 1), zz = entry(2, 2);
    K.xx += yy + zz, K.yy += xx + zz, K.zz += xx + yy;
    K.xy -= entry(0, 1), K.xz -= entry(0, 2), K.yz -= entry(1, 2);
    const Doubles c00 = K.yy * K.zz - K.yz * K.yz, c01 = K.xz * K.yz - K.xy * K.zz, c02 = K.xy * K.yz - K.xz * K.yy;
    const Doubles det = K.xx * c00 + K.xy * c01 + K.xz * c02, zero = {};
    const Doubles inverse = select<Doubles>(zero < det, 1.0 / det, zero);
    put_numbers(inverse * c00, to.K_inverse[0] + lane);
    put_numbers(inverse * (K.xx * K.zz - K.xz * K.xz), to.K_inverse[1] + lane);
    put_numbers(inverse * (K.xx * K.yy - K.xy * K.xy), to.K_inverse[2] + lane);
    put_numbers(inverse * c01, to.K_inverse[3] + lane);
    put_numbers(inverse * c02, to.K_inverse[4] + lane);
    put_numbers(inverse * (K.xy * K.xz - K.xx * K.yz), to.K_inverse[5] + lane);
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            put_numbers(RQ[r][c], to.RQ[r][c] + lane);
            put_numbers(pressure * RW[r][c], to.RW[r][c] + lane);
        }
    const Doubles b = load<Doubles>(g.b + lane);
    for (int i = 0; i < 6; ++i) put_numbers(load<Doubles>(g.N[i] + lane), to.N[i] + lane);
    put_numbers(b * load<Doubles>(g.inverse_mass + lane), to.center_scale + lane);
    put_numbers(b, to.b + lane);
}

template <class Real, bool newton>
void match(const SweepArrays<Real>& a, size_t begin, size_t end) {
    using V = typename Precision<Real>::Lanes;
    constexpr size_t kLanes = Precision<Real>::kLanes, kParticle = sizeof(SweepParticle<Real>) / sizeof(Real);
    const Real* particles = a.particles->x;
    const Real orientation_weight = static_cast<Real>(a.orientation_weight);
    for (size_t block = begin; block < end; ++block)
        for (size_t lane = 0; lane < 8; lane += kLanes) {
            const size_t first = 8 * block + lane;
            uint32_t own[8];
            for (size_t i = 0; i < kLanes; ++i) own[i] = static_cast<uint32_t>(first + i);
            V origin[4], center[3] = {}, A[3][3] = {}, E[3][3] = {};  // members' and ellipsoids' part of A_pq
            gather4<kParticle>(particles, own, 0, origin);
            Sym<V> H = {};
            for (size_t r = a.row_begin[block]; r < a.row_begin[block + 1]; ++r) {
                const SweepRow<Real>& row = a.rows[r];
                const uint32_t* members = a.neighbours + 8 * r + lane;
                V x[4];
                gather4<kParticle>(particles, members, 0, x);
                const V weight = load<V>(row.weight + lane), mass = weight * x[3];
                const V q[3] = {load<V>(row.q[0] + lane), load<V>(row.q[1] + lane), load<V>(row.q[2] + lane)};
                for (int i = 0; i < 3; ++i) {
                    const V mp = mass * (x[i] - origin[i]);
                    center[i] += mp;
                    for (int k = 0; k < 3; ++k) A[i][k] += mp * q[k];  // sum m q = 0: the centre of mass drops out
                }
                if constexpr (newton) {
                    constexpr size_t kRecord = sizeof(EllipsoidRecord) / sizeof(double);
                    V first[4], second[4], third[4], last[4];
                    gather4<kRecord>(a.ellipsoids->DM, members, 0, first);
                    gather4<kRecord>(a.ellipsoids->DM, members, 4, second);
                    gather4<kRecord>(a.ellipsoids->DM, members, 8, third);
                    gather4<kRecord>(a.ellipsoids->DM, members, 12, last);
                    E[0][0] += weight * first[0], E[0][1] += weight * first[1], E[0][2] += weight * first[2];
                    E[1][0] += weight * first[3], E[1][1] += weight * second[0], E[1][2] += weight * second[1];
                    E[2][0] += weight * second[2], E[2][1] += weight * second[3], E[2][2] += weight * third[0];
                    const V w = orientation_weight * weight;
                    H.xx += w * third[1], H.yy += w * third[2], H.zz += w * third[3];
                    H.xy += w * last[0], H.xz += w * last[1], H.yz += w * last[2];
                } else {
                    V d[4], D[3][3], DM[3][3];
                    gather4<kParticle>(particles, members, 4, d);
                    rotation_matrix(d, D);
                    multiply(D, sym<V>(row.moment, lane), DM);
                    for (int i = 0; i < 3; ++i)
                        for (int k = 0; k < 3; ++k) E[i][k] += DM[i][k];
                }
            }
            SweepGroups<Real>& g = a.groups[block];
            V AQ[3][3], AN[3][3], R[3][3], RQ[3][3], RW[3][3], rotation[4];
            multiply(A, sym<V>(g.isotropy, lane), AQ);
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k < 3; ++k) E[i][k] = AQ[i][k] + orientation_weight * E[i][k];
            for (int i = 0; i < 4; ++i) rotation[i] = load<V>(g.rotation[i] + lane);
            optimal_rotation<Real>(E, rotation, a.exact_rotation);
            for (int i = 0; i < 4; ++i) store(g.rotation[i] + lane, rotation[i]);

            // G = R Q + F (I - Q), less what pressure takes: E = lambda/2 V (tr(R^T A_pq W) - tr(A_qq W))^2 beside the
            // mu |F - R|^2 of shape matching has at member j the gradient lambda V (...) R W m_j q_j.
            rotation_matrix(rotation, R);
            multiply(R, sym<V>(g.isotropy, lane), RQ);
            multiply(R, sym<V>(g.volume_gradient, lane), RW);
            multiply(A, sym<V>(g.N, lane), AN);
            const V volume_strain = contract(RW, A) - load<V>(g.volume_rest + lane);
            const V pressure = load<V>(g.volume_ratio + lane) * load<V>(g.spread + lane) * volume_strain;
            V G[3][3];
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k < 3; ++k) G[i][k] = RQ[i][k] + AN[i][k] - pressure * RW[i][k];
            const V inverse_mass = load<V>(g.inverse_mass + lane), zero = {};
            Real* goals = a.goals[first].center;
            const V numbers[5][4] = {{origin[0] + inverse_mass * center[0], origin[1] + inverse_mass * center[1],
                                      origin[2] + inverse_mass * center[2], G[0][0]},
                                     {G[0][1], G[0][2], G[1][0], G[1][1]},
                                     {G[1][2], G[2][0], G[2][1], G[2][2]},
                                     {rotation[0], rotation[1], rotation[2], rotation[3]},
                                     {load<V>(g.b + lane), load<V>(g.bound + lane), zero, zero}};
            for (size_t i = 0; i < 5; ++i) scatter4<20>(goals, 4 * i, numbers[i]);
            if constexpr (newton) {
                if (a.newton)
                    put_newton(g, lane, R, RQ, RW, H, a.newton[block]);
                else
                    put_newton(g, lane, R, RQ, RW, H, a.newton_full[block]);
            }
        }
}

// x <- x + omega pull / total;  rotations as quaternions on d's side of the sphere: the weighted sum points at the
// chordal mean.
void average(const SweepArrays<float>& a, SweepParticle<float>* particles, JacobiParticles* jacobi, float omega,
             size_t begin, size_t end) {
    using V = Float8;
    const float turn_share = static_cast<float>(a.orientation_weight);
    const V zero = {};
    const auto same_side = [&](const V(&rotation)[4], const V(&d)[4], V weight) {
        const V cosine = rotation[0] * d[0] + rotation[1] * d[1] + rotation[2] * d[2] + rotation[3] * d[3];
        return select<V>(cosine < zero, -weight, weight);
    };
    for (size_t block = begin; block < end; ++block) {
        JacobiParticles& p = jacobi[block];
        uint32_t own[8];
        for (size_t i = 0; i < 8; ++i) own[i] = static_cast<uint32_t>(8 * block + i);
        V x[4], d[4], pull[3], inertial[4], turn[4];
        gather4<8>(a.particles->x, own, 0, x);
        gather4<8>(a.particles->x, own, 4, d);
        for (int i = 0; i < 3; ++i) pull[i] = load<V>(p.x_inertial[i]) - x[i];
        for (int i = 0; i < 4; ++i) inertial[i] = load<V>(p.d_inertial[i]);
        const V one = zero + 1.0f, side = same_side(inertial, d, one);
        for (int i = 0; i < 4; ++i) turn[i] = side * inertial[i];
        V total = one, total_turn = one;
        for (size_t r = a.row_begin[block]; r < a.row_begin[block + 1]; ++r) {
            const SweepRow<float>& row = a.rows[r];
            const uint32_t* groups = a.neighbours + 8 * r;
            const float* goals = a.goals->center;
            V c[4], second[4], third[4], rotation[4], weights[4];
            gather4<20>(goals, groups, 0, c);
            gather4<20>(goals, groups, 4, second);
            gather4<20>(goals, groups, 8, third);
            gather4<20>(goals, groups, 16, weights);
            const V q[3] = {load<V>(row.q_other[0]), load<V>(row.q_other[1]), load<V>(row.q_other[2])};
            const V w = load<V>(row.weight), b = w * weights[0];
            pull[0] += b * (c[0] + (c[3] * q[0] + second[0] * q[1] + second[1] * q[2]) - x[0]);
            pull[1] += b * (c[1] + (second[2] * q[0] + second[3] * q[1] + third[0] * q[2]) - x[1]);
            pull[2] += b * (c[2] + (third[1] * q[0] + third[2] * q[1] + third[3] * q[2]) - x[2]);
            gather4<20>(goals, groups, 12, rotation);
            const V turn_weight = turn_share * b, signed_weight = same_side(rotation, d, turn_weight);
            for (int i = 0; i < 4; ++i) turn[i] += signed_weight * rotation[i];
            total += w * weights[1];
            total_turn += turn_weight;
        }
        const V free = load<V>(p.free), step = free * (omega / total), share = omega / total_turn;
        V after[4];
        for (int i = 0; i < 3; ++i) {
            const V by = step * pull[i];
            x[i] += by;
            store(p.x_moved[i], load<V>(p.x_moved[i]) + by);
        }
        for (int i = 0; i < 4; ++i) after[i] = d[i] + (share * turn[i] - omega * d[i]);
        const V unit =
            one / root((after[0] * after[0] + after[2] * after[2]) + (after[1] * after[1] + after[3] * after[3]));
        for (int i = 0; i < 4; ++i) d[i] = select<V>(zero < free, unit * after[i], d[i]);
        scatter4<8>(particles[8 * block].x, 0, x);
        scatter4<8>(particles[8 * block].x, 4, d);
    }
}

// a times the conjugate of b, both x, y, z, w.
SUNDER_INLINE void times_conjugate(const Doubles (&a)[4], const Doubles (&b)[4], Doubles (&out)[4]) {
    out[0] = a[0] * b[3] - a[3] * b[0] + (a[2] * b[1] - a[1] * b[2]);
    out[1] = a[1] * b[3] - a[3] * b[1] + (a[0] * b[2] - a[2] * b[0]);
    out[2] = a[2] * b[3] - a[3] * b[2] + (a[1] * b[0] - a[0] * b[1]);
    out[3] = a[3] * b[3] + (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

SUNDER_INLINE void multiply(const Sym<Doubles>& m, const Doubles (&v)[3], Doubles (&out)[3]) {
    out[0] = m.xx * v[0] + m.xy * v[1] + m.xz * v[2];
    out[1] = m.xy * v[0] + m.yy * v[1] + m.yz * v[2];
    out[2] = m.xz * v[0] + m.yz * v[1] + m.zz * v[2];
}

// m^-1 v; of m = 0 zero.
SUNDER_INLINE void solve(const Sym<Doubles>& m, const Doubles (&v)[3], Doubles (&out)[3]) {
    const Sym<Doubles> adjugate = {m.yy * m.zz - m.yz * m.yz, m.xx * m.zz - m.xz * m.xz, m.xx * m.yy - m.xy * m.xy,
                                   m.xz * m.yz - m.xy * m.zz, m.xy * m.yz - m.xz * m.yy, m.xy * m.xz - m.xx * m.yz};
    const Doubles determinant = m.xx * adjugate.xx + m.xy * adjugate.xy + m.xz * adjugate.xz, zero = {};
    const Doubles inverse = 1.0 / select<Doubles>(zero < determinant, determinant, zero + 1.0);
    multiply(adjugate, v, out);
    for (int i = 0; i < 3; ++i) out[i] = inverse * out[i];
}

// A group with rotation R = S D that pulls a particle with rotation D turns it by the torque
//     vee(S M - M S^T) = 2 w H v + 2 v x (H v),      S = (v, w) as a quaternion, M and H = tr(M) I - M its second
// moments and inertia as it is turned: the gradient of the energy - tr(S^T M) that R minimises, summed over the group,
// so that no group turns itself. The angle of S times H, which is the same where it is small, does where it is not: two
// fragments of 100 MPa that stood 30 degrees askew to their bar went from 3 kJ to 4e10 J by it.
template <class Real>
void gather_residual(const SweepArrays<double>& a, NewtonParticles* particles, CgParticles<Real>* cg, size_t begin,
                     size_t end) {
    using V = Doubles;
    const V zero = {};
    for (size_t block = begin; block < end; ++block) {
        NewtonParticles& p = particles[block];
        CgParticles<Real>& to = cg[block];
        V magnitude = zero, size = zero;
        for (size_t lane = 0; lane < 8; lane += Precision<double>::kLanes) {
            V x[3], d[4], inertial[4], back[4], shift[3], turn[3];
            for (int i = 0; i < 3; ++i)
                x[i] = load<V>(p.x[i] + lane), shift[i] = load<V>(p.x_inertial[i] + lane) - x[i];
            for (int i = 0; i < 4; ++i) d[i] = load<V>(p.d[i] + lane), inertial[i] = load<V>(p.d_inertial[i] + lane);
            times_conjugate(inertial, d, back);
            rotation_vector(back, turn);
            const Sym<V> H = sym<V>(p.inertia, lane);
            const V drawn = 1.0 + load<V>(p.tether + lane);
            for (int i = 0; i < 3; ++i) shift[i] = drawn * shift[i], turn[i] = drawn * turn[i];
            V own = zero, bound = zero, twist[3] = {};
            for (size_t r = a.row_begin[block]; r < a.row_begin[block + 1]; ++r) {
                const SweepRow<double>& row = a.rows[r];
                const uint32_t* groups = a.neighbours + 8 * r + lane;
                const double* goals = a.goals->center;
                V c[4], second[4], third[4], rotation[4], weights[4];
                gather4<20>(goals, groups, 0, c);
                gather4<20>(goals, groups, 4, second);
                gather4<20>(goals, groups, 8, third);
                gather4<20>(goals, groups, 16, weights);
                const V q[3] = {load<V>(row.q_other[0] + lane), load<V>(row.q_other[1] + lane),
                                load<V>(row.q_other[2] + lane)};
                const V w = load<V>(row.weight + lane), b = w * weights[0];
                shift[0] += b * (c[0] + (c[3] * q[0] + second[0] * q[1] + second[1] * q[2]) - x[0]);
                shift[1] += b * (c[1] + (second[2] * q[0] + second[3] * q[1] + third[0] * q[2]) - x[1]);
                shift[2] += b * (c[2] + (third[1] * q[0] + third[2] * q[1] + third[3] * q[2]) - x[2]);
                gather4<20>(goals, groups, 12, rotation);
                times_conjugate(rotation, d, back);
                const V v[3] = {back[0], back[1], back[2]}, turn_weight = (2.0 * a.orientation_weight) * b;
                V Hv[3];
                multiply(H, v, Hv);
                for (int i = 0; i < 3; ++i) {
                    const int j = (i + 1) % 3, k = (i + 2) % 3;
                    turn[i] += turn_weight * (back[3] * v[i]);
                    twist[i] += turn_weight * (v[j] * Hv[k] - v[k] * Hv[j]);
                }
                own += b;
                bound += w * weights[1];
            }
            V twisted[3];
            solve(H, twist, twisted);
            const V free = load<V>(p.free + lane), free_turn = load<V>(p.free_turn + lane);
            const V mass = load<V>(p.mass + lane);
            const V braced = drawn + load<V>(p.brace + lane), inverse = free_turn / (braced + bound);
            for (int i = 0; i < 3; ++i) {
                shift[i] = free * shift[i], turn[i] = free_turn * (turn[i] + twisted[i]);
                store(p.residual[i] + lane, shift[i]), store(p.residual[i + 3] + lane, turn[i]);
            }
            V torque[3];
            multiply(H, turn, torque);
            magnitude += inverse * (mass * (shift[0] * shift[0] + shift[1] * shift[1] + shift[2] * shift[2]) +
                                    (turn[0] * torque[0] + turn[1] * torque[1] + turn[2] * torque[2]));
            size += 3.0 * load<V>(a.groups[block].spread + lane);
            put_numbers(mass, to.mass + lane);
            for (int i = 0; i < 6; ++i) put_numbers(load<V>(p.inertia[i] + lane), to.inertia[i] + lane);
            put_numbers(free * inverse, to.inverse_shift + lane), put_numbers(inverse, to.inverse_turn + lane);
            put_numbers(braced + own, to.own_shift + lane);
            put_numbers(drawn + a.orientation_weight * own, to.own_turn + lane);
        }
        p.magnitude = sum(magnitude);
        p.size = sum(size);
    }
}

}  // namespace

const SweepKernels SUNDER_KERNELS(kSweepKernels) = {expand<SweepRow<float>>,
                                                    expand<SweepRow<double>>,
                                                    expand<CgRow<float>>,
                                                    expand<CgRow<double>>,
                                                    take_in,
                                                    match<float, false>,
                                                    average,
                                                    give_back,
                                                    take_in_for_newton,
                                                    match<double, true>,
                                                    gather_residual<float>,
                                                    gather_residual<double>};

}  // namespace sunder
