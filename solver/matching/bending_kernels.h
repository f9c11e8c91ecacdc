// The products of conjugate gradients with the Hessian of thin groups (bending_shape.h), a block of eight groups at a
// time. Included by kernels that are compiled once for each instruction set, as lanes.h is.
#pragma once

#include <cstddef>
#include <cstdint>

#include "solver/lanes/lanes.h"

namespace sunder {

/// A row of LaneLayout: the lane's group's member; b is span^2. All 0: padding, or a group that is not thin. Places are
/// in the world, turns and K in the axes of the group's fragment as it is turned. Pulls lie in the spans
/// (BendingShape::span, arm_span): of sheets and rods two numbers are enough.
template <class Real>
struct alignas(64) BendingRow {
    Real weight[8], mean_part[8];                // b k w m; as BendingMember
    Real arm[3][8], pull[3][8], pull_arm[3][8];  // as BendingMember, in the spans
    Real lever[3][8];                            // from the weighted mean, m
    Real turn_rate[3][3][8];                     // J (D_g E)^T: of phi, by a turn of the member
    Real arc_rate[3][3][8];                      // D_g E W
    Real place[3][8], turn[3][8];                // scratch: of a motion z, off the bent shape
};

/// Eight groups.
template <class Real>
struct alignas(64) BendingGroups {
    Real softness[6][8], Gamma[3][8];  // D_g E X (D_g E)^T, Sym3; Gamma
    Real R_span[3][3][8];              // columns of D_g E R span
    Real kA[3][8];                     // b k A, which is diagonal in the span
    Real pull_sum[3][8];
    Real stretch[8], pressure[8];  // b 2 mu V; b lambda' V
    Real tension[3][8];            // b V of the stress in a sheet's span, as far as it pulls: xx, yy, xy
    Real turn_tension[6][8];       // b T of what is spanned in all directions (TurnTension), Sym3
    Real held[6][8];               // b (2 mu V)^2 (V c + 2 mu V sum (1 - R e (R e)^T))^-1, Sym3
    Real thinned[3][3][8];         // -nu / (2 (1 - nu)) D_g E of what is spanned in all directions (across_gradient)
    Real bending[9][9][8];         // b (bending form - k Gamma A_arm), of K arm_span column by column
};

/// Eight particles; 0 where they are held, or padding.
template <class Real>
struct alignas(64) BlockDiagonal {
    Real inverse_shift[6][8], inverse_turn[6][8];  // of the Hessian's blocks, Sym3, 1/kg and 1/(kg m2)
    Real inverse_mass[8], inverse_inertia[6][8];
};

/// Eight particles: z of their residual, and M z.
template <class Real>
struct alignas(64) KeptMotion {
    Real z[6][8], force[3][8], torque[3][8];
};

template <class Real>
struct BendingArrays {
    BendingRow<Real>* rows;               // as LaneLayout's
    const BendingGroups<Real>* groups;    // by block
    const uint8_t* columns;               // of spans, by block: 2 or 3 where a group of it bends, else 0
    const uint32_t* twin;                 // of each row and lane: where the lane's particle is in the member's group
    const BlockDiagonal<Real>* diagonal;  // by block
    KeptMotion<Real>* kept;               // by block
    Real* motion;                         // z of each lane: shift, 0, turn, 0          (n_lanes x 8)
    Real* pulls;                          // H z at each row and lane, as motion; the last is 0  (8 n_rows + 1, x 8)
    Real* cell_torque;                    // H z that turns each lane's own fragment    (n_lanes x 4)
    bool is_all_thin;                     // no group of the unit is a block
};

namespace {

template <class V, class Real>
SUNDER_INLINE void load_matrix(const Real (&from)[3][3][8], size_t lane, V (&out)[3][3]) {
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) out[i][k] = load<V>(from[i][k] + lane);
}
template <class V>
SUNDER_INLINE void product_of(const V (&m)[3][3], const V (&v)[3], V (&out)[3]) {
    for (int i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}
template <class V>
SUNDER_INLINE void transposed_product_of(const V (&m)[3][3], const V (&v)[3], V (&out)[3]) {
    for (int i = 0; i < 3; ++i) out[i] = m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2];
}
template <class V>
SUNDER_INLINE void cross_of(const V (&a)[3], const V (&b)[3], V (&out)[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1], out[1] = a[2] * b[0] - a[0] * b[2], out[2] = a[0] * b[1] - a[1] * b[0];
}
template <class V, class Real>
SUNDER_INLINE void load_vector(const Real (&from)[3][8], size_t lane, V (&out)[3]) {
    for (int i = 0; i < 3; ++i) out[i] = load<V>(from[i] + lane);
}

// The two halves of the records of some lanes, each looked up once.
template <class V, class Real>
SUNDER_INLINE void gather_halves(const Real* records, const uint32_t* lanes, V (&o_first)[4], V (&o_second)[4]) {
    constexpr size_t kCount = sizeof(V) / sizeof(Real);
    if constexpr (kCount == 8) {
        V in[2][4];
        for (size_t i = 0; i < 4; ++i) {
            const Real *const low = records + 8 * lanes[i], *const high = records + 8 * lanes[i + 4];
            in[0][i] = join(load<Float4>(low), load<Float4>(high));
            in[1][i] = join(load<Float4>(low + 4), load<Float4>(high + 4));
        }
        transpose(in[0], o_first), transpose(in[1], o_second);
    } else {
        gather4<8>(records, lanes, 0, o_first);
        gather4<8>(records, lanes, 4, o_second);
    }
}

// a b^T of vectors of three numbers and of as many as a span has columns.
template <int n, class V>
SUNDER_INLINE void add_outer_to(const V (&a)[3], const V (&b)[n], V (&io_m)[n][3]) {
    for (int c = 0; c < n; ++c)
        for (int i = 0; i < 3; ++i) io_m[c][i] += a[i] * b[c];
}
template <class V, class Real>
SUNDER_INLINE void symmetric_product_of(const Real (&S)[6][8], size_t lane, const V (&v)[3], V (&out)[3]) {
    const V xy = load<V>(S[3] + lane), xz = load<V>(S[4] + lane), yz = load<V>(S[5] + lane);
    out[0] = load<V>(S[0] + lane) * v[0] + xy * v[1] + xz * v[2];
    out[1] = xy * v[0] + load<V>(S[1] + lane) * v[1] + yz * v[2];
    out[2] = xz * v[0] + yz * v[1] + load<V>(S[2] + lane) * v[2];
}
template <int n, class V>
SUNDER_INLINE void product_of_columns(const V (&m)[n][3], const V (&v)[n], V (&out)[3]) {
    for (int i = 0; i < 3; ++i) {
        out[i] = m[0][i] * v[0] + m[1][i] * v[1];
        for (int c = 2; c < n; ++c) out[i] += m[c][i] * v[c];
    }
}
template <int n, class V, class Real>
SUNDER_INLINE void load_columns(const Real (&from)[3][8], size_t lane, V (&out)[n]) {
    for (int i = 0; i < n; ++i) out[i] = load<V>(from[i] + lane);
}

// What F, off the mean, pulls with, by columns.
template <int n, class V, class Real>
SUNDER_INLINE void stress_of(const BendingGroups<Real>& g, size_t lane, const V (&R_span)[n][3], const V (&F)[n][3],
                             V (&o_G)[n][3]) {
    V twist[3] = {}, held[3], trace = {}, kA[n];
    load_columns(g.kA, lane, kA);
    for (int c = 0; c < n; ++c) {
        V by[3];
        cross_of(R_span[c], F[c], by);
        for (int i = 0; i < 3; ++i) {
            twist[i] += by[i];
            trace += R_span[c][i] * F[c][i];
        }
    }
    symmetric_product_of(g.held, lane, twist, held);
    const V stretch = load<V>(g.stretch + lane), pressure = load<V>(g.pressure + lane) * trace;
    for (int c = 0; c < n; ++c) {
        V by[3], known[3];
        cross_of(R_span[c], held, by);
        symmetric_product_of(g.softness, lane, F[c], known);
        for (int i = 0; i < 3; ++i) o_G[c][i] = stretch * F[c][i] - kA[c] * known[i] + pressure * R_span[c][i] + by[i];
    }
}

// What is drawn resists what tilts it in space: F, which the fragment's own spin turned back. Adds that to what F pulls
// with, and to what turns the fragment. Of sheets and rods: they span no third direction.
template <int n, class V, class Real>
SUNDER_INLINE void add_tension(const BendingGroups<Real>& g, size_t lane, const V (&R_span)[n][3], const V (&spin)[3],
                               const V (&F)[n][3], V (&io_G)[n][3], V (&io_torque)[3]) {
    V tilt[2][3];
    for (int c = 0; c < 2; ++c) {
        cross_of(spin, R_span[c], tilt[c]);
        for (int i = 0; i < 3; ++i) tilt[c][i] += F[c][i];
        V along[2];
        for (int d = 0; d < 2; ++d)
            along[d] = R_span[d][0] * tilt[c][0] + R_span[d][1] * tilt[c][1] + R_span[d][2] * tilt[c][2];
        for (int i = 0; i < 3; ++i) tilt[c][i] -= along[0] * R_span[0][i] + along[1] * R_span[1][i];
    }
    const V xy = load<V>(g.tension[2] + lane);
    for (int c = 0; c < 2; ++c) {
        const V own = load<V>(g.tension[c] + lane);
        V drawn[3], by[3];
        for (int i = 0; i < 3; ++i) {
            drawn[i] = own * tilt[c][i] + xy * tilt[1 - c][i];
            io_G[c][i] += drawn[i];
        }
        cross_of(R_span[c], drawn, by);
        for (int i = 0; i < 3; ++i) io_torque[i] += by[i];
    }
}

// The same where all directions are spanned: half of the twist of F, and the spin, are how the group turns in space.
template <class V, class Real>
SUNDER_INLINE void add_turn_tension(const BendingGroups<Real>& g, size_t lane, const V (&R_span)[3][3],
                                    const V (&spin)[3], const V (&F)[3][3], V (&io_G)[3][3], V (&io_torque)[3]) {
    V turn[3] = {spin[0], spin[1], spin[2]}, drawn[3];
    for (int c = 0; c < 3; ++c) {
        V by[3];
        cross_of(R_span[c], F[c], by);
        for (int i = 0; i < 3; ++i) turn[i] += 0.5 * by[i];
    }
    symmetric_product_of(g.turn_tension, lane, turn, drawn);
    for (int c = 0; c < 3; ++c) {
        V by[3];
        cross_of(drawn, R_span[c], by);
        for (int i = 0; i < 3; ++i) io_G[c][i] += 0.5 * by[i];
    }
    for (int i = 0; i < 3; ++i) io_torque[i] += drawn[i];
}

// What K moves across what it bends, by the squares of arms, and what forces there have on K; of sheets and rods
// nothing.
template <int n, class V, class Real>
struct Thinned {
    SUNDER_INLINE Thinned(const BendingGroups<Real>&, size_t, const V (&)[n][3]) {}
    SUNDER_INLINE void add_to(const V (&)[n], V (&)[3]) const {}
    SUNDER_INLINE void push(const V (&)[n], const V (&)[3]) {}
    SUNDER_INLINE void take_from(V (&)[n][3]) const {}
};
template <class V, class Real>
struct Thinned<3, V, Real> {
    V axes[3][3], across[3], pushed[3] = {};

    SUNDER_INLINE Thinned(const BendingGroups<Real>& g, size_t lane, const V (&K)[3][3])
        : across{K[1][2] - K[2][1], K[2][0] - K[0][2], K[0][1] - K[1][0]} {
        load_matrix(g.thinned, lane, axes);
    }
    SUNDER_INLINE void add_to(const V (&arm)[3], V (&io_place)[3]) const {
        const V in_axes[3] = {arm[0] * arm[0] * across[0], arm[1] * arm[1] * across[1], arm[2] * arm[2] * across[2]};
        V by[3];
        product_of(axes, in_axes, by);
        for (int i = 0; i < 3; ++i) io_place[i] += by[i];
    }
    SUNDER_INLINE void push(const V (&arm)[3], const V (&force)[3]) {
        V by[3];
        transposed_product_of(axes, force, by);
        for (int i = 0; i < 3; ++i) pushed[i] += arm[i] * arm[i] * by[i];
    }
    // From columns, as K's.
    SUNDER_INLINE void take_from(V (&io_moment)[3][3]) const {
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            io_moment[j][k] -= pushed[i], io_moment[k][j] += pushed[i];
        }
    }
};
// H z of the thin groups, z in `motion`: to `pulls` and `cell_torque`. Eight groups in four passes over their rows:
//   turns and K;  places off the bent shape and F;  forces, and the moment that they have on K;  torques.
// What is left of places after F, r = v - F q, and of turns after K need not be formed: F and K are least squares of
// them, so that sum w r X r = sum w v X v - F A F X. K and F have n columns, those of the spans.
template <int n, class V, class Real>
SUNDER_INLINE void multiply_block(const BendingArrays<Real>& a, const uint32_t* row_begin, const uint32_t* neighbours,
                                  size_t block) {
    constexpr size_t kCount = sizeof(V) / sizeof(Real);
    static constexpr uint32_t kSelf[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    const BendingGroups<Real>& g = a.groups[block];
    for (size_t lane = 0; lane < 8; lane += kCount) {
        const size_t first = row_begin[block], last = row_begin[block + 1];
        V own[4], K[n][3] = {}, F[n][3] = {}, mean[3] = {};
        gather4<8>(a.motion + 64 * block, kSelf + lane, 4, own);
        const V spin[3] = {own[0], own[1], own[2]};
        for (size_t r = first; r < last; ++r) {
            BendingRow<Real>& row = a.rows[r];
            V shifted[4], turned[4], rate[3][3], turn[3], pull_arm[n], lever[3], swept[3];
            gather_halves(a.motion, neighbours + 8 * r + lane, shifted, turned);
            const V by[3] = {turned[0] - spin[0], turned[1] - spin[1], turned[2] - spin[2]};
            load_matrix(row.turn_rate, lane, rate);
            product_of(rate, by, turn);
            load_columns(row.pull_arm, lane, pull_arm);
            add_outer_to(turn, pull_arm, K);
            load_vector(row.lever, lane, lever);
            cross_of(lever, spin, swept);
            for (int i = 0; i < 3; ++i) {
                store(row.turn[i] + lane, turn[i]);
                store(row.place[i] + lane, shifted[i] + swept[i]);
            }
        }
        Thinned<n, V, Real> thinned(g, lane, K);
        for (size_t r = first; r < last; ++r) {
            BendingRow<Real>& row = a.rows[r];
            V place[3], arm[n], bent[3], rate[3][3], arc[3], pull[n];
            load_vector(row.place, lane, place);
            load_columns(row.arm, lane, arm);
            product_of_columns(K, arm, bent);
            load_matrix(row.arc_rate, lane, rate);
            product_of(rate, bent, arc);
            thinned.add_to(arm, arc);
            load_columns(row.pull, lane, pull);
            const V part = load<V>(row.mean_part + lane);
            for (int i = 0; i < 3; ++i) {
                place[i] -= arc[i];
                mean[i] += part * place[i];
                store(row.place[i] + lane, place[i]);
            }
            add_outer_to(place, pull, F);
        }
        V pull_sum[n], G[n][3];
        load_columns(g.pull_sum, lane, pull_sum);
        for (int c = 0; c < n; ++c)
            for (int i = 0; i < 3; ++i) F[c][i] -= mean[i] * pull_sum[c];
        V R_span[n][3], moment[n][3], total[3] = {}, torque[3] = {};
        for (int c = 0; c < n; ++c) load_vector(g.R_span[c], lane, R_span[c]);
        stress_of(g, lane, R_span, F, G);
        add_tension(g, lane, R_span, spin, F, G, torque);
        if constexpr (n == 3) add_turn_tension(g, lane, R_span, spin, F, G, torque);
        for (int i = 0; i < 3 * n; ++i) {
            V sum = {};
            for (int m = 0; m < 3 * n; ++m) sum += load<V>(g.bending[i][m] + lane) * K[m / 3][m % 3];
            moment[i / 3][i % 3] = sum;
        }
        for (size_t r = first; r < last; ++r) {
            BendingRow<Real>& row = a.rows[r];
            const V weight = load<V>(row.weight + lane);
            V place[3], pull[n], force[3], held[3], lever[3], by[3], rate[3][3], back[3], arm[n];
            load_vector(row.place, lane, place);
            load_columns(row.pull, lane, pull);
            product_of_columns(G, pull, force);
            for (int i = 0; i < 3; ++i) place[i] -= mean[i];
            symmetric_product_of(g.softness, lane, place, held);
            for (int i = 0; i < 3; ++i) {
                force[i] += weight * held[i];
                total[i] += force[i];
                store(row.place[i] + lane, force[i]);
            }
            load_vector(row.lever, lane, lever);
            cross_of(lever, force, by);
            load_matrix(row.arc_rate, lane, rate);
            transposed_product_of(rate, force, back);
            load_columns(row.arm, lane, arm);
            for (int i = 0; i < 3; ++i) {
                torque[i] -= by[i];
                for (int c = 0; c < n; ++c) moment[c][i] -= back[i] * arm[c];
            }
            thinned.push(arm, force);
        }
        thinned.take_from(moment);
        V Gamma[3];
        load_vector(g.Gamma, lane, Gamma);
        const V zero = {};
        for (size_t r = first; r < last; ++r) {
            BendingRow<Real>& row = a.rows[r];
            const V weight = load<V>(row.weight + lane), part = load<V>(row.mean_part + lane);
            V force[3], turn[3], pull_arm[n], turned[3], rate[3][3], by[3];
            load_vector(row.place, lane, force);
            for (int i = 0; i < 3; ++i) force[i] -= part * total[i];
            load_columns(row.pull_arm, lane, pull_arm);
            load_vector(row.turn, lane, turn);
            product_of_columns(moment, pull_arm, turned);
            for (int i = 0; i < 3; ++i) turned[i] += weight * (Gamma[i] * turn[i]);
            load_matrix(row.turn_rate, lane, rate);
            transposed_product_of(rate, turned, by);
            for (int i = 0; i < 3; ++i) torque[i] -= by[i];
            const V shift4[4] = {force[0], force[1], force[2], zero}, turn4[4] = {by[0], by[1], by[2], zero};
            scatter4<8>(a.pulls + 8 * (8 * r + lane), 0, shift4);
            scatter4<8>(a.pulls + 8 * (8 * r + lane), 4, turn4);
        }
        const V cell4[4] = {torque[0], torque[1], torque[2], zero};
        scatter4<4>(a.cell_torque + 4 * (8 * block + lane), 0, cell4);
    }
}

// Apart from that of two columns, which has the registers to itself so.
template <class V, class Real>
[[gnu::noinline]] void multiply_slender_block(const BendingArrays<Real>& a, const uint32_t* row_begin,
                                              const uint32_t* neighbours, size_t block) {
    multiply_block<3, V>(a, row_begin, neighbours, block);
}

template <class V, class Real>
void multiply_bending(const BendingArrays<Real>& a, const uint32_t* row_begin, const uint32_t* neighbours, size_t begin,
                      size_t end) {
    for (size_t block = begin; block < end; ++block) {
        if (a.columns[block] == 2) multiply_block<2, V>(a, row_begin, neighbours, block);
        if (a.columns[block] == 3) multiply_slender_block<V>(a, row_begin, neighbours, block);
    }
}

template <class Real>
struct SumOf;
template <>
struct SumOf<float> {
    using Lanes = Float8;
};
template <>
struct SumOf<double> {
    using Lanes = Double4;
};
template <class Real>
using Sum = typename SumOf<Real>::Lanes;
template <class Real>
constexpr size_t kOfSum = sizeof(Sum<Real>) / sizeof(Real);

// What multiply_bending did to the particles of a block, of some lanes.
template <class V, class Real>
SUNDER_INLINE void gather_bending(const BendingArrays<Real>& a, const uint32_t* row_begin, size_t block, size_t lane,
                                  V (&force)[3], V (&torque)[3]) {
    static constexpr uint32_t kSelf[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    constexpr size_t kCount = sizeof(V) / sizeof(Real);
    // Each lane's records are added up as they are: shift, 0, turn, 0.
    Real sums[kCount][8];
    for (size_t l = 0; l < kCount; ++l) {
        Sum<Real> sum[8 / kOfSum<Real>] = {};
        for (size_t r = row_begin[block]; r < row_begin[block + 1]; ++r) {
            const Real* from = a.pulls + 8 * a.twin[8 * r + lane + l];
            for (size_t i = 0; i < 8 / kOfSum<Real>; ++i) sum[i] += load<Sum<Real>>(from + kOfSum<Real> * i);
        }
        for (size_t i = 0; i < 8 / kOfSum<Real>; ++i) store(sums[l] + kOfSum<Real> * i, sum[i]);
    }
    V own[4], shift[4], turn[4];
    gather4<4>(a.cell_torque + 32 * block, kSelf + lane, 0, own);
    gather4<8>(&sums[0][0], kSelf, 0, shift);
    gather4<8>(&sums[0][0], kSelf, 4, turn);
    for (int i = 0; i < 3; ++i) force[i] = shift[i], torque[i] = own[i] + turn[i];
}

}  // namespace
}  // namespace sunder
