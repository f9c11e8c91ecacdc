// Compiled once for each instruction set (lanes.h).
#include "solver/matching/rest_shape_kernels.h"

#include "solver/data/ids.h"
#include "solver/lanes/lane_eigen.h"

namespace sunder {
namespace {

using V = Double4;
using M3 = V[3][3];

constexpr double kThinnest = 0.25, kFlattest = 1e-6;  // of the largest eigenvalue

// The members of one row, one of each group; lanes of groups that have no more of them weigh nothing.
struct MemberRow {
    uint32_t particle[4], slot[4];
    bool is_member[4];
    V x[3];          // from the group's centre at rest
    V weight, mass;  // w, w m

    SUNDER_INLINE MemberRow(const RestShapeRecords& r, const uint32_t (&groups)[4], uint32_t row) {
        double places[3][4], weights[4], masses[4];
        for (size_t i = 0; i < 4; ++i) {
            const uint32_t g = groups[i];
            slot[i] = r.begin[g] + row, is_member[i] = slot[i] < r.end[g];
            particle[i] = is_member[i] ? r.member[slot[i]] : g;
            for (size_t k = 0; k < 3; ++k) places[k][i] = r.positions[3 * particle[i] + k] - r.positions[3 * g + k];
            const uint32_t edge = is_member[i] ? r.edge[slot[i]] : kNone;
            weights[i] = !is_member[i] ? 0 : edge == kNone ? 1 : r.edge_weights[edge];
            masses[i] = r.masses[particle[i]];
        }
        for (size_t k = 0; k < 3; ++k) x[k] = load<V>(places[k]);
        weight = load<V>(weights), mass = weight * load<V>(masses);
    }
};

// What is written of a group, in the order of its numbers.
struct ShapeNumbers {
    V numbers[RestShapeRecords::kNumbers];
    size_t n = 0;

    SUNDER_INLINE void put(V number) { numbers[n++] = number; }
    SUNDER_INLINE void put(const Sym<V>& s) { put(s.xx), put(s.yy), put(s.zz), put(s.xy), put(s.xz), put(s.yz); }
    SUNDER_INLINE void put(const M3& m) {
        for (int i = 0; i < 9; ++i) put(m[i % 3][i / 3]);
    }
    SUNDER_INLINE void write(const RestShapeRecords& r, const uint32_t (&groups)[4]) const {
        double* shapes[4];
        for (size_t i = 0; i < 4; ++i) shapes[i] = r.shapes + RestShapeRecords::kShapeNumbers * groups[i];
        for (size_t k = 0; k < RestShapeRecords::kNumbers; k += 4) {
            const V four[4] = {numbers[k], numbers[k + 1], numbers[k + 2], numbers[k + 3]};
            scatter_numbers(shapes, k, four);
        }
    }
};

SUNDER_INLINE V greatest(const V (&a)[3]) { return maximum(a[0], maximum(a[1], a[2])); }
SUNDER_INLINE V trace(const Sym<V>& s) { return s.xx + s.yy + s.zz; }

// V^T A V
SUNDER_INLINE Sym<V> turned(const Sym<V>& A, const M3& E) {
    M3 full, left, inner;
    to_matrix(A, full);
    multiply_transposed(E, full, left);
    multiply(left, E, inner);
    return {inner[0][0], inner[1][1], inner[2][2], inner[0][1], inner[0][2], inner[1][2]};
}

// Q, N, the stiffness moment and the largest ratio of a GroupShape, E and a being directions and eigenvalues of the
// members' part of A_qq.
//
// A ring on a face of a body has more members along the face than across it. Weighed by A_qq alone the group would be
// too stiff along it, 1.24 times on a face of a lattice and 1.67 times on an edge; weighed by s it is mu |F - R|^2 in
// every direction. Where the ring is thin, s falls with a: what few members tell of F there must not be blown up. Where
// it is flat they tell nothing, and their goal is carried by R as in the paper.
SUNDER_INLINE V balance_directions(const M3& E, const V (&a)[3], ShapeNumbers& io_numbers) {
    const V zero = {}, one = zero + 1.0, mean = (1.0 / 3) * (a[0] + a[1] + a[2]), most = greatest(a);
    V ratio[3], affine[3], stiffness[3];
    for (int i = 0; i < 3; ++i) {
        const Mask<V> has_extent = kFlattest * most < a[i];
        const V thick = maximum(a[i], kThinnest * most);
        ratio[i] = select<V>(has_extent, mean / thick, one);
        affine[i] = select<V>(has_extent, (one - ratio[i]) / a[i], zero);
        stiffness[i] = ratio[i] * a[i];
    }
    io_numbers.put(compose(E, ratio)), io_numbers.put(compose(E, affine)), io_numbers.put(compose(E, stiffness));
    return maximum(one, greatest(ratio));
}

// W, its product with A_qq, and what pressure adds at most, E and a being directions and eigenvalues of all of A_qq.
// Volume strain is tr(R^T A_pq A_qq^-1) - 3, with the inverse bounded in thin directions: a flat group has no stiffness
// of its own across the sheet, and an unbounded inverse would demand vanishing steps.
struct VolumeResponse {
    Sym<V> gradient;
    V rest, most_pressure;

    SUNDER_INLINE VolumeResponse(const M3& E, const V (&a)[3], const Sym<V>& A_positions, V positions_trace) {
        const V least = kThinnest * greatest(a);
        V inverse[3];
        for (int i = 0; i < 3; ++i) inverse[i] = 1.0 / maximum(a[i], least);
        gradient = compose(E, inverse);
        rest = (A_positions.xx * gradient.xx + A_positions.yy * gradient.yy + A_positions.zz * gradient.zz) +
               2.0 * (A_positions.xy * gradient.xy + A_positions.xz * gradient.xz + A_positions.yz * gradient.yz);
        const V square = inverse[0] * inverse[0] + inverse[1] * inverse[1] + inverse[2] * inverse[2];
        most_pressure = positions_trace * root((1.0 / 3) * square);
    }
};

void build(const RestShapeRecords& r, const uint32_t (&groups)[4]) {
    uint32_t n_rows = 0;
    double has_others[4];
    const double* plastic[4];
    for (size_t i = 0; i < 4; ++i) {
        const uint32_t n = r.end[groups[i]] - r.begin[groups[i]];
        n_rows = n_rows < n ? n : n_rows;
        has_others[i] = n > 1;
        plastic[i] = r.plastic_deformation + 9 * groups[i];
    }
    M3 F_P;
    gather_matrix(plastic, 0, F_P);

    V mass = {}, center[3] = {};
    for (uint32_t row = 0; row < n_rows; ++row) {
        const MemberRow m(r, groups, row);
        mass += m.mass;
        for (int k = 0; k < 3; ++k) center[k] += m.mass * m.x[k];
    }
    for (V& c : center) c = c / mass;

    Sym<V> A = {}, moments = {};  // of the members' places, and of their ellipsoids
    for (uint32_t row = 0; row < n_rows; ++row) {
        const MemberRow m(r, groups, row);
        const V x = m.x[0] - center[0], y = m.x[1] - center[1], z = m.x[2] - center[2];
        V member[4];
        for (int k = 0; k < 3; ++k) member[k] = F_P[k][0] * x + F_P[k][1] * y + F_P[k][2] * z;
        member[3] = m.weight;
        double unused[4], *slots[4];
        const double* of_ellipsoids[4];
        for (size_t i = 0; i < 4; ++i) {
            slots[i] = m.is_member[i] ? r.members + RestShapeRecords::kMemberNumbers * m.slot[i] : unused;
            of_ellipsoids[i] = r.moments + 6 * m.particle[i];
        }
        scatter_numbers(slots, 0, member);
        const V mx = m.mass * member[0], my = m.mass * member[1], mz = m.mass * member[2];
        A.xx += mx * member[0], A.yy += my * member[1], A.zz += mz * member[2];
        A.xy += mx * member[1], A.xz += mx * member[2], A.yz += my * member[2];
        const Sym<V> own = gather_symmetric(of_ellipsoids, 0);
        moments.xx += m.weight * own.xx, moments.yy += m.weight * own.yy, moments.zz += m.weight * own.zz;
        moments.xy += m.weight * own.xy, moments.xz += m.weight * own.xz, moments.yz += m.weight * own.yz;
    }

    const double w = r.moment_weight;
    const Sym<V> A_qq = {A.xx + w * moments.xx, A.yy + w * moments.yy, A.zz + w * moments.zz,
                         A.xy + w * moments.xy, A.xz + w * moments.xz, A.yz + w * moments.yz};
    M3 basis, E;
    V a[3], a_positions[3];
    set_identity(basis);
    diagonalize(A_qq, basis, a);
    // A group of no extent at all has no strain either.
    const V least = maximum(1e-9 * greatest(a), V() + 1e-100);
    for (V& value : a) value = maximum(value, least);
    for (int i = 0; i < 9; ++i) E[i / 3][i % 3] = basis[i / 3][i % 3];
    diagonalize(turned(A, basis), E, a_positions);

    ShapeNumbers numbers;
    const V positions_trace = load<V>(has_others) * trace(A);
    const VolumeResponse volume(basis, a, A, positions_trace);
    numbers.put(mass), numbers.put(positions_trace), numbers.put(basis);
    numbers.put({2.0 / (a[0] + a[0]), 2.0 / (a[1] + a[1]), 2.0 / (a[2] + a[2]), 2.0 / (a[0] + a[1]),
                 2.0 / (a[0] + a[2]), 2.0 / (a[1] + a[2])});
    const V most_isotropy = balance_directions(E, a_positions, numbers);
    numbers.put(volume.gradient), numbers.put(volume.rest), numbers.put(most_isotropy);
    numbers.put(volume.most_pressure);
    numbers.write(r, groups);
}

}  // namespace

const RestShapeKernels SUNDER_KERNELS(kRestShapeKernels) = {build};

}  // namespace sunder
