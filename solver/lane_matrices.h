// 3x3 matrices lane by lane. For kernels alone, as lanes.h.
#pragma once

#include "solver/lanes.h"

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

// out = A S
template <class V>
SUNDER_INLINE void multiply(const V (&A)[3][3], const Sym<V>& S, V (&out)[3][3]) {
    for (int r = 0; r < 3; ++r) {
        out[r][0] = A[r][0] * S.xx + A[r][1] * S.xy + A[r][2] * S.xz;
        out[r][1] = A[r][0] * S.xy + A[r][1] * S.yy + A[r][2] * S.yz;
        out[r][2] = A[r][0] * S.xz + A[r][1] * S.yz + A[r][2] * S.zz;
    }
}

template <class V>
SUNDER_INLINE V contract(const V (&A)[3][3], const V (&B)[3][3]) {
    return (A[0][0] * B[0][0] + A[0][1] * B[0][1] + A[0][2] * B[0][2]) +
           (A[1][0] * B[1][0] + A[1][1] * B[1][1] + A[1][2] * B[1][2]) +
           (A[2][0] * B[2][0] + A[2][1] * B[2][1] + A[2][2] * B[2][2]);
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
