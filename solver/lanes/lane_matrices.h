// 3x3 matrices lane by lane. For kernels alone, as lanes.h.
#pragma once

#include "solver/lanes/lanes.h"

namespace sunder {
namespace {

template <class V>
struct Sym {
    V xx, yy, zz, xy, xz, yz;
};

template <class V, class Real>
SUNDER_INLINE Sym<V> sym(const Real (&S)[6][8], size_t lane) {
    return {load<V>(S[0] + lane), load<V>(S[1] + lane), load<V>(S[2] + lane),
            load<V>(S[3] + lane), load<V>(S[4] + lane), load<V>(S[5] + lane)};
}

template <class V>
SUNDER_INLINE void to_matrix(const Sym<V>& S, V (&out)[3][3]) {
    out[0][0] = S.xx, out[0][1] = S.xy, out[0][2] = S.xz;
    out[1][0] = S.xy, out[1][1] = S.yy, out[1][2] = S.yz;
    out[2][0] = S.xz, out[2][1] = S.yz, out[2][2] = S.zz;
}

// out = A S
template <class V>
SUNDER_INLINE void multiply(const V (&A)[3][3], const Sym<V>& S, V (&out)[3][3]) {
    for (int r = 0; r < 3; ++r) {
        out[r][0] = A[r][0] * S.xx + A[r][1] * S.xy + A[r][2] * S.xz;
        out[r][1] = A[r][0] * S.xy + A[r][1] * S.yy + A[r][2] * S.yz;
        out[r][2] = A[r][0] * S.xz + A[r][1] * S.yz + A[r][2] * S.zz;
    }
}

// out = A B
template <class V>
SUNDER_INLINE void multiply(const V (&A)[3][3], const V (&B)[3][3], V (&out)[3][3]) {
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) out[r][c] = A[r][0] * B[0][c] + A[r][1] * B[1][c] + A[r][2] * B[2][c];
}

// out = A^T B
template <class V>
SUNDER_INLINE void multiply_transposed(const V (&A)[3][3], const V (&B)[3][3], V (&out)[3][3]) {
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) out[r][c] = A[0][r] * B[0][c] + A[1][r] * B[1][c] + A[2][r] * B[2][c];
}

template <class V>
SUNDER_INLINE V contract(const V (&A)[3][3], const V (&B)[3][3]) {
    return (A[0][0] * B[0][0] + A[0][1] * B[0][1] + A[0][2] * B[0][2]) +
           (A[1][0] * B[1][0] + A[1][1] * B[1][1] + A[1][2] * B[1][2]) +
           (A[2][0] * B[2][0] + A[2][1] * B[2][1] + A[2][2] * B[2][2]);
}

// A matrix of four records, column by column.
SUNDER_INLINE void gather_matrix(const double* const (&records)[4], size_t offset, Double4 (&out)[3][3]) {
    Double4 first[4], second[4], last[4];
    gather_numbers(records, offset, first);
    gather_numbers(records, offset + 4, second);
    gather_numbers(records, offset + 5, last);
    const Double4 numbers[9] = {first[0],  first[1],  first[2],  first[3], second[0],
                                second[1], second[2], second[3], last[3]};
    for (int i = 0; i < 9; ++i) out[i % 3][i / 3] = numbers[i];
}

SUNDER_INLINE Sym<Double4> gather_symmetric(const double* const (&records)[4], size_t offset) {
    Double4 first[4], last[4];
    gather_numbers(records, offset, first);
    gather_numbers(records, offset + 2, last);
    return {first[0], first[1], first[2], first[3], last[2], last[3]};
}

// Of a unit quaternion x, y, z, w.
template <class V>
SUNDER_INLINE void rotation_matrix(const V (&q)[4], V (&R)[3][3]) {
    const V x2 = q[0] + q[0], y2 = q[1] + q[1], z2 = q[2] + q[2];
    const V wx = x2 * q[3], wy = y2 * q[3], wz = z2 * q[3];
    const V xx = x2 * q[0], xy = y2 * q[0], xz = z2 * q[0], yy = y2 * q[1], yz = z2 * q[1], zz = z2 * q[2];
    R[0][0] = 1 - (yy + zz), R[0][1] = xy - wz, R[0][2] = xz + wy;
    R[1][0] = xy + wz, R[1][1] = 1 - (xx + zz), R[1][2] = yz - wx;
    R[2][0] = xz - wy, R[2][1] = yz + wx, R[2][2] = 1 - (xx + yy);
}

}  // namespace
}  // namespace sunder
