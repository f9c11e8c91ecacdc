// The products of conjugate gradients with the Hessian of thin groups (bending_shape.h), a block of eight groups at a
// time. Included by kernels that are compiled once for each instruction set, as lanes.h is.
#pragma once

#include <cstddef>
#include <cstdint>

#include "solver/lanes/lanes.h"

namespace sunder {

/// A row of LaneLayout: the lane's group's member, in the axes of the group's fragment as it is turned; b is
/// span^2. All 0: padding, or a group that is not thin.
template <class Real>
struct alignas(64) BendingRow {
    Real weight[8], mean_part[8];                // b k w m; as BendingMember
    Real arm[3][8], pull[3][8], pull_arm[3][8];  // as BendingMember
    Real lever[3][8];                            // from the weighted mean, m
    Real turn_rate[3][3][8];                     // J (D_g E)^T: of phi, by a turn of the member in the world
    Real arc_rate[3][3][8];                      // W
    Real place[3][8], turn[3][8];                // scratch: of a motion z, off the bent shape
};

/// Eight groups.
template <class Real>
struct alignas(64) BendingGroups {
    Real axes[3][3][8];                 // D_g E
    Real softness[3][8], kGamma[3][8];  // X; Gamma
    Real RP[3][3][8], kA[6][8];         // R P; b k A, Sym3
    Real pull_sum[3][8];
    Real stretch[8], pressure[8];  // b 2 mu V; b lambda' V
    Real held[6][8];               // b (2 mu V)^2 (V c + 2 mu V sum (1 - R e (R e)^T))^-1, Sym3
    Real bending[9][9][8];         // b (bending form - k Gamma A_arm), of K column by column
};

/// Eight particles; 0 where they are held, or padding.
template <class Real>
struct alignas(64) BlockDiagonal {
    Real inverse_shift[6][8], inverse_turn[6][8];  // of the Hessian's blocks, Sym3, 1/kg and 1/(kg m2)
    Real inverse_mass[8], inverse_inertia[6][8];
};

template <class Real>
struct BendingArrays {
    BendingRow<Real>* rows;               // as LaneLayout's
    const BendingGroups<Real>* groups;    // by block
    const uint8_t* is_thin;               // by block: a group of it is
    const uint32_t* twin;                 // of each row and lane: where the lane's particle is in the member's group
    const BlockDiagonal<Real>* diagonal;  // by block
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

// H z of the thin groups, z in `motion`: to `pulls` and `cell_torque`. Eight groups in four passes over their rows:
//   turns and K;  places off the bent shape and F;  forces, and the moment that they have on K;  torques.
// What is left of places after F, r = v - F q, and of turns after K need not be formed: F and K are least squares of
// them, so that sum w r X r = sum w v X v - F A F X.
template <class V, class Real>
void multiply_bending(const BendingArrays<Real>& a, const uint32_t* row_begin, const uint32_t* neighbours, size_t begin,
                      size_t end) {
    constexpr size_t kCount = sizeof(V) / sizeof(Real);
    static constexpr uint32_t kSelf[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    for (size_t block = begin; block < end; ++block) {
        if (!a.is_thin[block]) continue;
        const BendingGroups<Real>& g = a.groups[block];
        for (size_t lane = 0; lane < 8; lane += kCount) {
            const size_t first = row_begin[block], last = row_begin[block + 1];
            V axes[3][3], own[4], own_turn[3], K[3][3] = {}, F[3][3] = {}, mean[3] = {};
            load_matrix(g.axes, lane, axes);
            gather4<8>(a.motion + 64 * block, kSelf + lane, 4, own);
            const V spin[3] = {own[0], own[1], own[2]};
            transposed_product_of(axes, spin, own_turn);
            for (size_t r = first; r < last; ++r) {
                BendingRow<Real>& row = a.rows[r];
                V turned[4], rate[3][3], turn[3], pull_arm[3];
                gather4<8>(a.motion, neighbours + 8 * r + lane, 4, turned);
                const V by[3] = {turned[0] - spin[0], turned[1] - spin[1], turned[2] - spin[2]};
                load_matrix(row.turn_rate, lane, rate);
                product_of(rate, by, turn);
                load_vector(row.pull_arm, lane, pull_arm);
                for (int i = 0; i < 3; ++i) {
                    store(row.turn[i] + lane, turn[i]);
                    for (int k = 0; k < 3; ++k) K[i][k] += turn[i] * pull_arm[k];
                }
            }
            for (size_t r = first; r < last; ++r) {
                BendingRow<Real>& row = a.rows[r];
                V shifted[4], place[3], lever[3], swept[3], arm[3], bent[3], rate[3][3], arc[3], pull[3];
                gather4<8>(a.motion, neighbours + 8 * r + lane, 0, shifted);
                const V shift[3] = {shifted[0], shifted[1], shifted[2]};
                transposed_product_of(axes, shift, place);
                load_vector(row.lever, lane, lever);
                cross_of(lever, own_turn, swept);
                load_vector(row.arm, lane, arm);
                product_of(K, arm, bent);
                load_matrix(row.arc_rate, lane, rate);
                product_of(rate, bent, arc);
                load_vector(row.pull, lane, pull);
                const V part = load<V>(row.mean_part + lane);
                for (int i = 0; i < 3; ++i) {
                    place[i] = place[i] + swept[i] - arc[i];
                    mean[i] += part * place[i];
                    store(row.place[i] + lane, place[i]);
                    for (int k = 0; k < 3; ++k) F[i][k] += place[i] * pull[k];
                }
            }
            V pull_sum[3], RP[3][3], softness[3], G[3][3], twist[3] = {}, held[3], trace = {};
            load_vector(g.pull_sum, lane, pull_sum);
            load_matrix(g.RP, lane, RP);
            load_vector(g.softness, lane, softness);
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k < 3; ++k) {
                    F[i][k] -= mean[i] * pull_sum[k];
                    trace += RP[i][k] * F[i][k];
                }
            for (int k = 0; k < 3; ++k) {
                const V line[3] = {RP[0][k], RP[1][k], RP[2][k]}, moved[3] = {F[0][k], F[1][k], F[2][k]};
                V by[3];
                cross_of(line, moved, by);
                for (int i = 0; i < 3; ++i) twist[i] += by[i];
            }
            const auto symmetric = [&](const Real(&S)[6][8], const V(&v)[3], V(&out)[3]) {
                const V xy = load<V>(S[3] + lane), xz = load<V>(S[4] + lane), yz = load<V>(S[5] + lane);
                out[0] = load<V>(S[0] + lane) * v[0] + xy * v[1] + xz * v[2];
                out[1] = xy * v[0] + load<V>(S[1] + lane) * v[1] + yz * v[2];
                out[2] = xz * v[0] + yz * v[1] + load<V>(S[2] + lane) * v[2];
            };
            symmetric(g.held, twist, held);
            const V stretch = load<V>(g.stretch + lane), pressure = load<V>(g.pressure + lane) * trace;
            for (int i = 0; i < 3; ++i) {
                const V line[3] = {F[i][0], F[i][1], F[i][2]};
                V known[3];
                symmetric(g.kA, line, known);
                for (int k = 0; k < 3; ++k) G[i][k] = stretch * F[i][k] + pressure * RP[i][k] - softness[i] * known[k];
            }
            for (int k = 0; k < 3; ++k) {
                const V line[3] = {RP[0][k], RP[1][k], RP[2][k]};
                V by[3];
                cross_of(line, held, by);
                for (int i = 0; i < 3; ++i) G[i][k] += by[i];
            }
            V moment[3][3], total[3] = {}, torque[3] = {};
            for (int k = 0; k < 3; ++k)
                for (int i = 0; i < 3; ++i) {
                    V sum = {};
                    for (int l = 0; l < 3; ++l)
                        for (int m = 0; m < 3; ++m) sum += load<V>(g.bending[i + 3 * k][m + 3 * l] + lane) * K[m][l];
                    moment[i][k] = sum;
                }
            for (size_t r = first; r < last; ++r) {
                BendingRow<Real>& row = a.rows[r];
                const V weight = load<V>(row.weight + lane);
                V place[3], pull[3], force[3], lever[3], by[3], rate[3][3], back[3], arm[3];
                load_vector(row.place, lane, place);
                load_vector(row.pull, lane, pull);
                product_of(G, pull, force);
                for (int i = 0; i < 3; ++i) {
                    force[i] += weight * (softness[i] * (place[i] - mean[i]));
                    total[i] += force[i];
                    store(row.place[i] + lane, force[i]);
                }
                load_vector(row.lever, lane, lever);
                cross_of(lever, force, by);
                load_matrix(row.arc_rate, lane, rate);
                transposed_product_of(rate, force, back);
                load_vector(row.arm, lane, arm);
                for (int i = 0; i < 3; ++i) {
                    torque[i] -= by[i];
                    for (int k = 0; k < 3; ++k) moment[i][k] -= back[i] * arm[k];
                }
            }
            V Gamma[3], cell[3];
            load_vector(g.kGamma, lane, Gamma);
            product_of(axes, torque, cell);
            const V zero = {};
            for (size_t r = first; r < last; ++r) {
                BendingRow<Real>& row = a.rows[r];
                const V weight = load<V>(row.weight + lane), part = load<V>(row.mean_part + lane);
                V place[3], turn[3], pull_arm[3], turned[3], rate[3][3], by[3], force[3];
                load_vector(row.place, lane, place);
                for (int i = 0; i < 3; ++i) place[i] -= part * total[i];
                product_of(axes, place, force);
                load_vector(row.pull_arm, lane, pull_arm);
                load_vector(row.turn, lane, turn);
                product_of(moment, pull_arm, turned);
                for (int i = 0; i < 3; ++i) turned[i] += weight * (Gamma[i] * turn[i]);
                load_matrix(row.turn_rate, lane, rate);
                transposed_product_of(rate, turned, by);
                for (int i = 0; i < 3; ++i) cell[i] -= by[i];
                const V shift4[4] = {force[0], force[1], force[2], zero}, turn4[4] = {by[0], by[1], by[2], zero};
                scatter4<8>(a.pulls + 8 * (8 * r + lane), 0, shift4);
                scatter4<8>(a.pulls + 8 * (8 * r + lane), 4, turn4);
            }
            const V cell4[4] = {cell[0], cell[1], cell[2], zero};
            scatter4<4>(a.cell_torque + 4 * (8 * block + lane), 0, cell4);
        }
    }
}

// What multiply_bending did to the particles of a block, of some lanes.
template <class V, class Real>
SUNDER_INLINE void gather_bending(const BendingArrays<Real>& a, const uint32_t* row_begin, size_t block, size_t lane,
                                  V (&force)[3], V (&torque)[3]) {
    static constexpr uint32_t kSelf[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    V own[4];
    gather4<4>(a.cell_torque + 32 * block, kSelf + lane, 0, own);
    for (int i = 0; i < 3; ++i) force[i] = V{}, torque[i] = own[i];
    for (size_t r = row_begin[block]; r < row_begin[block + 1]; ++r) {
        const uint32_t* twins = a.twin + 8 * r + lane;
        V shift[4], turn[4];
        gather4<8>(a.pulls, twins, 0, shift);
        gather4<8>(a.pulls, twins, 4, turn);
        for (int i = 0; i < 3; ++i) force[i] += shift[i], torque[i] += turn[i];
    }
}

}  // namespace
}  // namespace sunder
