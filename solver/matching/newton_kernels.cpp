// Compiled once for each instruction set (lanes.h).
#include "solver/matching/newton_kernels.h"

#include "solver/lanes/lanes.h"
#include "solver/matching/bending_kernels.h"

namespace sunder {
namespace {

template <class Real>
struct CgLanes;
template <>
struct CgLanes<float> {
    using V = Float8;
    static constexpr size_t kCount = 8;
};
template <>
struct CgLanes<double> {
    using V = Double4;
    static constexpr size_t kCount = 4;
};
template <class Real>
using Lanes = typename CgLanes<Real>::V;

template <class V>
SUNDER_INLINE V dot(const V* a, const V* b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Symmetric matrix (Sym3, lane by lane) times a vector.
template <class V, class Real>
SUNDER_INLINE void multiply(const Real (&S)[6][8], size_t lane, const V (&v)[3], V (&out)[3]) {
    const V xy = load<V>(S[3] + lane), xz = load<V>(S[4] + lane), yz = load<V>(S[5] + lane);
    out[0] = load<V>(S[0] + lane) * v[0] + xy * v[1] + xz * v[2];
    out[1] = xy * v[0] + load<V>(S[1] + lane) * v[1] + yz * v[2];
    out[2] = xz * v[0] + yz * v[1] + load<V>(S[2] + lane) * v[2];
}

// z and M z of some lanes of a block.
template <class V>
struct Preconditioned {
    V z[6], force[3], torque[3];
};
template <bool bends, class V, class Real>
SUNDER_INLINE void take(const CgArrays<Real>& a, size_t block, size_t lane, const V (&s)[6], Preconditioned<V>& out) {
    const CgParticles<Real>& p = a.particles[block];
    const V mass = load<V>(p.mass + lane);
    if constexpr (bends) {
        const BlockDiagonal<Real>& diagonal = a.bending->diagonal[block];
        const V turned[3] = {s[3], s[4], s[5]}, force[3] = {mass * s[0], mass * s[1], mass * s[2]};
        V torque[3], shift[3], turn[3];
        multiply(p.inertia, lane, turned, torque);
        multiply(diagonal.inverse_shift, lane, force, shift);
        multiply(diagonal.inverse_turn, lane, torque, turn);
        for (int i = 0; i < 3; ++i) out.z[i] = shift[i], out.z[i + 3] = turn[i];
    } else {
        const V shift = load<V>(p.inverse_shift + lane), turn = load<V>(p.inverse_turn + lane);
        for (int i = 0; i < 3; ++i) out.z[i] = shift * s[i], out.z[i + 3] = turn * s[i + 3];
    }
    for (int i = 0; i < 3; ++i) out.force[i] = mass * out.z[i];
    const V turn[3] = {out.z[3], out.z[4], out.z[5]};
    multiply(p.inertia, lane, turn, out.torque);
}

// Writes the momentum of z; returns z . M s.
template <bool bends, class Real, class V>
SUNDER_INLINE double put(const CgArrays<Real>& a, const Preconditioned<V>& z, const V (&s)[6], size_t first) {
    const V zero = {};
    if (!bends || !a.bending->is_all_thin) {
        const V force[4] = {z.force[0], z.force[1], z.force[2], zero};
        const V torque[4] = {z.torque[0], z.torque[1], z.torque[2], zero};
        scatter4<8>(a.momentum + 8 * first, 0, force);
        scatter4<8>(a.momentum + 8 * first, 4, torque);
    }
    if constexpr (bends) {
        KeptMotion<Real>& kept = a.bending->kept[first / 8];
        const size_t lane = first % 8;
        for (int i = 0; i < 6; ++i) store(kept.z[i] + lane, z.z[i]);
        for (int i = 0; i < 3; ++i) store(kept.force[i] + lane, z.force[i]), store(kept.torque[i] + lane, z.torque[i]);
        const V shift[4] = {z.z[0], z.z[1], z.z[2], zero}, turn[4] = {z.z[3], z.z[4], z.z[5], zero};
        scatter4<8>(a.bending->motion + 8 * first, 0, shift);
        scatter4<8>(a.bending->motion + 8 * first, 4, turn);
    }
    return static_cast<double>(sum(dot(z.force, s) + dot(z.torque, s + 3)));
}

// What `put` wrote last, of s as it is; of a diagonal of 3x3 blocks it is dear to find.
template <bool bends, class V, class Real>
SUNDER_INLINE void take_again(const CgArrays<Real>& a, size_t block, size_t lane, const V (&s)[6],
                              Preconditioned<V>& out) {
    if constexpr (bends) {
        const KeptMotion<Real>& kept = a.bending->kept[block];
        for (int i = 0; i < 6; ++i) out.z[i] = load<V>(kept.z[i] + lane);
        for (int i = 0; i < 3; ++i)
            out.force[i] = load<V>(kept.force[i] + lane), out.torque[i] = load<V>(kept.torque[i] + lane);
    } else {
        take<bends>(a, block, lane, s, out);
    }
}

template <class Real, bool bends>
void precondition(const CgArrays<Real>& a, size_t begin, size_t end) {
    using V = Lanes<Real>;
    for (size_t block = begin; block < end; ++block) {
        a.magnitude[block] = 0;
        for (size_t lane = 0; lane < 8; lane += CgLanes<Real>::kCount) {
            V s[6];
            for (int i = 0; i < 6; ++i) s[i] = load<V>(a.particles[block].residual[i] + lane);
            Preconditioned<V> z;
            take<bends>(a, block, lane, s, z);
            a.magnitude[block] += put<bends>(a, z, s, 8 * block + lane);
        }
    }
}

template <class Real, bool bends>
void fit_groups(const CgArrays<Real>& a, size_t begin, size_t end) {
    using V = Lanes<Real>;
    if constexpr (bends) {
        multiply_bending<V>(*a.bending, a.row_begin, a.neighbours, begin, end);
        if (a.bending->is_all_thin) return;
    }
    for (size_t block = begin; block < end; ++block)
        for (size_t lane = 0; lane < 8; lane += CgLanes<Real>::kCount) {
            V shift[3] = {}, spin[3] = {}, A[3][3] = {};
            for (size_t r = a.row_begin[block]; r < a.row_begin[block + 1]; ++r) {
                const CgRow<Real>& row = a.rows[r];
                const uint32_t* members = a.neighbours + 8 * r + lane;
                const V weight = load<V>(row.weight + lane);
                V force[4], torque[4];
                gather4<8>(a.momentum, members, 0, force);
                const V q[3] = {load<V>(row.q[0] + lane), load<V>(row.q[1] + lane), load<V>(row.q[2] + lane)};
                for (int i = 0; i < 3; ++i) {
                    const V f = weight * force[i];
                    shift[i] += f;
                    for (int k = 0; k < 3; ++k) A[i][k] += f * q[k];
                }
                gather4<8>(a.momentum, members, 4, torque);
                for (int i = 0; i < 3; ++i) spin[i] += weight * torque[i];
            }
            const CgGroups<Real>& g = a.groups[block];
            V RQ[3][3], RW[3][3];
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k < 3; ++k)
                    RQ[i][k] = load<V>(g.RQ[i][k] + lane), RW[i][k] = load<V>(g.RW[i][k] + lane);
            spin[0] = a.orientation_weight * spin[0] + (dot(A[2], RQ[1]) - dot(A[1], RQ[2]));
            spin[1] = a.orientation_weight * spin[1] + (dot(A[0], RQ[2]) - dot(A[2], RQ[0]));
            spin[2] = a.orientation_weight * spin[2] + (dot(A[1], RQ[0]) - dot(A[0], RQ[1]));
            V turn[3];
            multiply(g.K_inverse, lane, spin, turn);
            const V volume_strain = dot(A[0], RW[0]) + dot(A[1], RW[1]) + dot(A[2], RW[2]);
            const V b = load<V>(g.b + lane);
            V T[3][3];  // -b P,  P = -[turn]x R Q - A N + volume_strain R W
            for (int i = 0; i < 3; ++i) {
                const int j = (i + 1) % 3, l = (i + 2) % 3;
                V affine[3];
                multiply(g.N, lane, A[i], affine);
                for (int k = 0; k < 3; ++k)
                    T[i][k] = b * (turn[j] * RQ[l][k] - turn[l] * RQ[j][k] + affine[k] - volume_strain * RW[i][k]);
            }
            const V scale = load<V>(g.center_scale + lane), turn_weight = a.orientation_weight * b, zero = {};
            const V numbers[4][4] = {{scale * shift[0], scale * shift[1], scale * shift[2], T[0][0]},
                                     {T[0][1], T[0][2], T[1][0], T[1][1]},
                                     {T[1][2], T[2][0], T[2][1], T[2][2]},
                                     {turn_weight * turn[0], turn_weight * turn[1], turn_weight * turn[2], zero}};
            for (size_t i = 0; i < 4; ++i) scatter4<16>(a.pulls + 16 * (8 * block + lane), 4 * i, numbers[i]);
        }
}

template <class Real, bool bends>
void gather_product(const CgArrays<Real>& a, size_t begin, size_t end) {
    using V = Lanes<Real>;
    for (size_t block = begin; block < end; ++block) {
        a.curvature[block] = 0;
        for (size_t lane = 0; lane < 8; lane += CgLanes<Real>::kCount) {
            V shift[3] = {}, turn[3] = {};
            size_t r = a.row_begin[block];
            if constexpr (bends)
                if (a.bending->is_all_thin) r = a.row_begin[block + 1];
            for (; r < a.row_begin[block + 1]; ++r) {
                const CgRow<Real>& row = a.rows[r];
                const uint32_t* groups = a.neighbours + 8 * r + lane;
                const V weight = load<V>(row.weight + lane);
                const V q[3] = {load<V>(row.q_other[0] + lane), load<V>(row.q_other[1] + lane),
                                load<V>(row.q_other[2] + lane)};
                V first[4], second[4], third[4], fourth[4];
                gather4<16>(a.pulls, groups, 0, first);
                gather4<16>(a.pulls, groups, 4, second);
                shift[0] += weight * (first[0] + (first[3] * q[0] + second[0] * q[1] + second[1] * q[2]));
                gather4<16>(a.pulls, groups, 8, third);
                shift[1] += weight * (first[1] + (second[2] * q[0] + second[3] * q[1] + third[0] * q[2]));
                shift[2] += weight * (first[2] + (third[1] * q[0] + third[2] * q[1] + third[3] * q[2]));
                gather4<16>(a.pulls, groups, 12, fourth);
                for (int i = 0; i < 3; ++i) turn[i] += weight * fourth[i];
            }
            const CgParticles<Real>& p = a.particles[block];
            CgVectors<Real>& v = a.vectors[block];
            V s[6], product[6];
            for (int i = 0; i < 6; ++i) s[i] = load<V>(p.residual[i] + lane);
            Preconditioned<V> z;
            take_again<bends>(a, block, lane, s, z);
            const V own_shift = load<V>(p.own_shift + lane), own_turn = load<V>(p.own_turn + lane);
            for (int i = 0; i < 3; ++i) {
                product[i] = load<V>(v.product[i] + lane) + (own_shift * z.z[i] - shift[i]);
                product[i + 3] = load<V>(v.product[i + 3] + lane) + (own_turn * z.z[i + 3] - turn[i]);
            }
            if constexpr (bends) {
                V force[3], torque[3], twisted[3];
                gather_bending(*a.bending, a.row_begin, block, lane, force, torque);
                multiply(a.bending->diagonal[block].inverse_inertia, lane, torque, twisted);
                const V inverse_mass = load<V>(a.bending->diagonal[block].inverse_mass + lane);
                for (int i = 0; i < 3; ++i) product[i] += inverse_mass * force[i], product[i + 3] += twisted[i];
            }
            for (int i = 0; i < 6; ++i) store(v.product[i] + lane, product[i]);
            a.curvature[block] += static_cast<double>(sum(dot(z.force, product) + dot(z.torque, product + 3)));
        }
    }
}

template <class Real, bool bends>
void advance(const CgArrays<Real>& a, Real alpha, Real beta, size_t begin, size_t end) {
    using V = Lanes<Real>;
    for (size_t block = begin; block < end; ++block) {
        CgParticles<Real>& p = a.particles[block];
        CgVectors<Real>& v = a.vectors[block];
        a.magnitude[block] = 0;
        for (size_t lane = 0; lane < 8; lane += CgLanes<Real>::kCount) {
            const V zero = {};
            V s[6];
            Preconditioned<V> z;
            for (int i = 0; i < 6; ++i) s[i] = load<V>(p.residual[i] + lane);
            take_again<bends>(a, block, lane, s, z);
            for (int i = 0; i < 6; ++i) {
                const V direction = z.z[i] + beta * load<V>(v.direction[i] + lane);
                const V image = load<V>(v.product[i] + lane) + beta * load<V>(v.image[i] + lane);
                s[i] -= alpha * image;
                store(v.direction[i] + lane, direction);
                store(v.image[i] + lane, image);
                store(v.solution[i] + lane, load<V>(v.solution[i] + lane) + alpha * direction);
                store(p.residual[i] + lane, s[i]);
                store(v.product[i] + lane, zero);
            }
            take<bends>(a, block, lane, s, z);
            a.magnitude[block] += put<bends>(a, z, s, 8 * block + lane);
        }
    }
}

template <class Real, bool bends>
constexpr NewtonKernels<Real> kKernels = {precondition<Real, bends>, fit_groups<Real, bends>,
                                          gather_product<Real, bends>, advance<Real, bends>};

}  // namespace

const CgKernels SUNDER_KERNELS(kNewtonKernels) = {kKernels<float, false>, kKernels<float, true>,
                                                  kKernels<double, false>, kKernels<double, true>};

}  // namespace sunder
