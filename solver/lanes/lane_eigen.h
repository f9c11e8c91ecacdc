// Eigenvalues and directions of symmetric 3x3 matrices lane by lane. For kernels alone, as lanes.h.
#pragma once

#include "solver/lanes/lane_matrices.h"

namespace sunder {
namespace {

// Jacobi's rotation of a plane p, q.
template <class V>
struct PlaneRotation {
    V tangent, cosine, sine;

    // The one that makes the entry pq zero; none at all in lanes that are not active.
    SUNDER_INLINE PlaneRotation(V pp, V qq, V pq, Mask<V> active) {
        const V zero = {}, one = zero + 1.0, apart = qq - pp, twice = pq + pq;
        const V reach = root(apart * apart + twice * twice);
        const Mask<V> is_below = apart < zero, is_turned = active & (zero < reach);
        const V sum = select<V>(is_below, apart - reach, apart + reach);  // of the sign of `apart`
        const V share = 1.0 / root(sum * sum + twice * twice);
        tangent = select<V>(is_turned, twice / sum, zero);
        cosine = select<V>(is_turned, select<V>(is_below, -sum, sum) * share, one);
        sine = tangent * cosine;
    }
    SUNDER_INLINE void turn(V& p, V& q) const {
        const V former = p;
        p = cosine * former - sine * q, q = sine * former + cosine * q;
    }
};

// pr and qr: entries of the third direction; columns p and q of E turn with them.
template <class V>
SUNDER_INLINE void annihilate(V& pp, V& qq, V& pq, V& pr, V& qr, V (&E)[3][3], int p, int q, Mask<V> active) {
    const PlaneRotation<V> rotation(pp, qq, pq, active);
    pp -= rotation.tangent * pq, qq += rotation.tangent * pq, pq = V();
    rotation.turn(pr, qr);
    for (int r = 0; r < 3; ++r) rotation.turn(E[r][p], E[r][q]);
}

// E^T A E is made diagonal, beginning with the rotation E: its columns are then the directions of the eigenvalues, in
// any order. No lane's bits depend on what the others hold.
template <class V>
SUNDER_INLINE void diagonalize(Sym<V> A, V (&io_E)[3][3], V (&o_eigenvalues)[3]) {
    for (int sweep = 0; sweep < 12; ++sweep) {
        // What is left off the diagonal changes no eigenvalue by more than its own size.
        const V off = A.xy * A.xy + A.xz * A.xz + A.yz * A.yz;
        const Mask<V> active = 1e-32 * (A.xx * A.xx + A.yy * A.yy + A.zz * A.zz) < off;
        if (!any(active)) break;
        annihilate(A.xx, A.yy, A.xy, A.xz, A.yz, io_E, 0, 1, active);
        annihilate(A.xx, A.zz, A.xz, A.xy, A.yz, io_E, 0, 2, active);
        annihilate(A.yy, A.zz, A.yz, A.xy, A.xz, io_E, 1, 2, active);
    }
    o_eigenvalues[0] = A.xx, o_eigenvalues[1] = A.yy, o_eigenvalues[2] = A.zz;
}

template <class V>
SUNDER_INLINE void set_identity(V (&E)[3][3]) {
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) E[r][c] = V() + (r == c ? 1.0 : 0.0);
}

// Eigenvalues in ascending order, and the columns of E with them.
template <class V>
SUNDER_INLINE void sort_ascending(V (&io_eigenvalues)[3], V (&io_E)[3][3]) {
    const auto exchange = [](Mask<V> is_wrong, V& a, V& b) {
        const V former = a;
        a = select<V>(is_wrong, b, a), b = select<V>(is_wrong, former, b);
    };
    constexpr int kPair[3][2] = {{0, 1}, {1, 2}, {0, 1}};
    for (const auto& [i, j] : kPair) {
        const Mask<V> is_wrong = io_eigenvalues[j] < io_eigenvalues[i];
        exchange(is_wrong, io_eigenvalues[i], io_eigenvalues[j]);
        for (int r = 0; r < 3; ++r) exchange(is_wrong, io_E[r][i], io_E[r][j]);
    }
}

// E diag(d) E^T
template <class V>
SUNDER_INLINE Sym<V> compose(const V (&E)[3][3], const V (&d)[3]) {
    V scaled[3][3];
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) scaled[r][c] = E[r][c] * d[c];
    const auto entry = [&](int r, int c) {
        return scaled[r][0] * E[c][0] + scaled[r][1] * E[c][1] + scaled[r][2] * E[c][2];
    };
    return {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)};
}

}  // namespace
}  // namespace sunder
