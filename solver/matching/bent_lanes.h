// Vectors and matrices of four groups as they are kept, and arcs: arc.h lane by lane. For bent_kernels.cpp alone.
#pragma once

#include "solver/lanes/lane_rotation.h"
#include "solver/matching/bending_kernels.h"

namespace sunder {
namespace {

using V = Double4;
using M3 = V[3][3];

template <size_t n>
SUNDER_INLINE void put(const V (&v)[n], double (&to)[n][4]) {
    for (size_t i = 0; i < n; ++i) store(to[i], v[i]);
}
SUNDER_INLINE void put(const M3& m, double (&to)[3][3][4]) {
    for (int i = 0; i < 3; ++i) put(m[i], to[i]);
}
template <size_t n>
SUNDER_INLINE void get(const double (&from)[n][4], V (&out)[n]) {
    for (size_t i = 0; i < n; ++i) out[i] = load<V>(from[i]);
}
SUNDER_INLINE void get(const double (&from)[3][3][4], M3& out) {
    for (int i = 0; i < 3; ++i) get(from[i], out[i]);
}
SUNDER_INLINE void gather_vector(const double* const (&records)[4], size_t offset, V (&out)[3]) {
    V numbers[4];
    gather_numbers(records, offset, numbers);
    for (int i = 0; i < 3; ++i) out[i] = numbers[i];
}
SUNDER_INLINE V gather_number(const double* const (&records)[4], size_t offset) {
    const double numbers[4] = {records[0][offset], records[1][offset], records[2][offset], records[3][offset]};
    return load<V>(numbers);
}
SUNDER_INLINE V dot(const V (&a)[3], const V (&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

SUNDER_INLINE void add_outer(const V (&a)[3], const V (&b)[3], M3& io_m) {
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) io_m[i][k] += a[i] * b[k];
}

// (1 - cos t) / t^2 and (t - sin t) / t^3 as series in t^2, and their derivatives by t over t: those of Arc.
constexpr int kTerms = 13;                   // up to three quarters of a turn
constexpr int kNearTerms = 6;                // up to
constexpr double kNear2 = 0.06, kFar2 = 10;  // rad2
struct ArcSeries {
    double a[kTerms] = {}, b[kTerms] = {}, da[kTerms] = {}, db[kTerms] = {};

    constexpr ArcSeries() {
        double factorial = 1, sign = 1;  // of 2n + 1
        for (int n = 0; n < kTerms; ++n, sign = -sign) {
            if (n > 0) factorial *= 2 * n * (2 * n + 1);
            const double even = factorial * (2 * n + 2), odd = even * (2 * n + 3);
            a[n] = sign / even, b[n] = sign / odd;
            const double next = odd * (2 * n + 4);
            da[n] = -sign * 2 * (n + 1) / next, db[n] = -sign * 2 * (n + 1) / (next * (2 * n + 5));
        }
    }
};
constexpr ArcSeries kSeries;

// Each lane by its own t^2: near ones have no need of what far ones beside them need.
struct Angle {
    V t2;
    Mask<V> is_far;
    bool any_far;

    SUNDER_INLINE explicit Angle(V square) : t2(square), is_far(V() + kNear2 < square), any_far(any(is_far)) {}
    template <int n>
    SUNDER_INLINE V sum(const double (&c)[kTerms]) const {
        V s = V() + c[n - 1];
        for (int i = n - 2; i >= 0; --i) s = c[i] + t2 * s;
        return s;
    }
    SUNDER_INLINE V operator()(const double (&c)[kTerms]) const {
        const V near = sum<kNearTerms>(c);
        return any_far ? select<V>(is_far, sum<kTerms>(c), near) : near;
    }
};

// As rotation_vector_rate: c = 1/t^2 - cot(t/2) / (2 t) = -a' / (2 t a).
SUNDER_INLINE void rotation_vector_rate(const V (&phi)[3], M3& out) {
    const Angle angle(dot(phi, phi));
    const V c = -angle(kSeries.da) / (2.0 * angle(kSeries.a));
    const V half[3] = {0.5 * phi[0], 0.5 * phi[1], 0.5 * phi[2]};
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) out[i][k] = c * (phi[i] * phi[k]);
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i][i] += 1.0 - c * angle.t2;
        out[i][j] += half[k], out[j][i] -= half[k];
    }
}

// Those beyond the series.
SUNDER_INLINE void far_arcs(void (*exact)(const double*, const double*, double*), const Angle& angle, const V (&phi)[3],
                            const V (&q)[3], V (&place)[3], M3& rate) {
    double turns[3][4], arms[3][4], arcs[12][4], squares[4];
    put(phi, turns), put(q, arms), store(squares, angle.t2);
    for (int i = 0; i < 3; ++i) store(arcs[i], place[i]);
    for (int i = 0; i < 9; ++i) store(arcs[3 + i], rate[i / 3][i % 3]);
    for (size_t lane = 0; lane < 4; ++lane) {
        if (squares[lane] < kFar2) continue;
        const double turn[3] = {turns[0][lane], turns[1][lane], turns[2][lane]};
        const double arm[3] = {arms[0][lane], arms[1][lane], arms[2][lane]};
        double arc[12];
        exact(turn, arm, arc);
        for (int i = 0; i < 12; ++i) arcs[i][lane] = arc[i];
    }
    for (int i = 0; i < 3; ++i) place[i] = load<V>(arcs[i]);
    for (int i = 0; i < 9; ++i) rate[i / 3][i % 3] = load<V>(arcs[3 + i]);
}

// As Arc; `rate` only where it is asked for.
SUNDER_INLINE void find_arc(void (*exact)(const double*, const double*, double*), const V (&phi)[3], const V (&q)[3],
                            bool with_rate, V (&place)[3], M3& rate) {
    const Angle angle(dot(phi, phi));
    const V a = angle(kSeries.a), b = angle(kSeries.b);
    V across[3], back[3];
    cross_of(phi, q, across);
    cross_of(phi, across, back);
    for (int i = 0; i < 3; ++i) place[i] = a * across[i] + b * back[i];
    if (with_rate) {
        const V da = angle(kSeries.da), db = angle(kSeries.db), along = dot(phi, q);
        V by[3], turned[3];
        // [phi]x [q]x = q phi^T - phi . q
        for (int i = 0; i < 3; ++i) by[i] = da * across[i] + db * back[i] - b * q[i];
        for (int i = 0; i < 3; ++i) turned[i] = a * q[i] + b * across[i];
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) rate[i][k] = by[i] * phi[k];
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            rate[i][i] += b * along;
            rate[i][j] += turned[k], rate[j][i] -= turned[k];
        }
    }
    if (angle.any_far && any(V() + kFar2 < angle.t2)) far_arcs(exact, angle, phi, q, place, rate);
}

// As across_gradient; and back, cross_matrix of what each of its numbers does.
SUNDER_INLINE void across_gradient(const M3& K, V (&out)[3]) {
    for (int i = 0; i < 3; ++i) out[i] = K[(i + 2) % 3][(i + 1) % 3] - K[(i + 1) % 3][(i + 2) % 3];
}
SUNDER_INLINE void take_across(const V (&by)[3], M3& io_m) {
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        io_m[k][j] -= by[i], io_m[j][k] += by[i];
    }
}

}  // namespace
}  // namespace sunder
