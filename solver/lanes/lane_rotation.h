// Rotations as unit quaternions x, y, z, w, lane by lane. For kernels alone, as lanes.h.
#pragma once

#include "solver/lanes/lane_matrices.h"

namespace sunder {
namespace {

// optimal_rotation of polar_decomposition.cpp, of four; q: warm start, then the result.
SUNDER_INLINE void optimal_rotation(const Double4 (&A)[3][3], Double4 (&q)[4], void (*exact)(const double*, double*)) {
    using V = Double4;
    const V zero = {}, one = zero + 1.0;
    const auto square = [&](int i) { return A[i % 3][i / 3] * A[i % 3][i / 3]; };
    const V even = (square(0) + square(2)) + (square(4) + square(6));
    const V odd = (square(1) + square(3)) + (square(5) + square(7));
    const V scale = root((even + odd) + square(8)), tiny = 1e-9 * scale;
    Mask<V> active = zero < scale, lost = tiny < zero;  // none
    for (int iteration = 0; iteration < 12 && any(active); ++iteration) {
        V R[3][3], B[3][3];
        rotation_matrix(q, R);
        multiply_transposed(R, A, B);
        const V gx = B[2][1] - B[1][2], gy = B[0][2] - B[2][0], gz = B[1][0] - B[0][1];
        const V trace = B[0][0] + (B[1][1] + B[2][2]);
        const V xx = trace - B[0][0], yy = trace - B[1][1], zz = trace - B[2][2];
        const V xy = -0.5 * (B[0][1] + B[1][0]), xz = -0.5 * (B[0][2] + B[2][0]), yz = -0.5 * (B[1][2] + B[2][1]);
        const V c00 = yy * zz - yz * yz, c01 = xz * yz - xy * zz, c02 = xy * yz - xz * yy;
        const V c11 = xx * zz - xz * xz, c12 = xy * xz - xx * yz, c22 = xx * yy - xy * xy;
        const V det = xx * c00 + xy * c01 + xz * c02;
        const V wx = (c00 * gx + c01 * gy + c02 * gz) / det, wy = (c01 * gx + c11 * gy + c12 * gz) / det,
                wz = (c02 * gx + c12 * gy + c22 * gz) / det;
        const V step = wx * wx + wy * wy + wz * wz;
        const Mask<V> proper = (tiny < xx) & (1e-3 * (tiny * scale) < c22) & (1e-6 * (tiny * scale * scale) < det);
        const Mask<V> good = proper & ~(one < step);
        lost = lost | (active & ~good);
        active = active & good;
        // q (1, w / 2), as a product of quaternions is summed.
        const V x = 0.5 * wx, y = 0.5 * wy, z = 0.5 * wz;
        const V turned[4] = {(q[3] * x + q[1] * z) - (q[2] * y - q[0]), (q[3] * y + q[1]) + (q[2] * x - q[0] * z),
                             (q[3] * z - q[1] * x) + (q[2] + q[0] * y), (q[3] - q[1] * y) - (q[2] * z + q[0] * x)};
        const V norm =
            root((turned[0] * turned[0] + turned[2] * turned[2]) + (turned[1] * turned[1] + turned[3] * turned[3]));
        for (int i = 0; i < 4; ++i) q[i] = select<V>(active, turned[i] / norm, q[i]);
        active = active & ~(step < (zero + 1e-14));
    }
    lost = lost | active;
    if (!any(lost)) return;
    double a[9][4], rotation[4][4], is_lost[4];
    for (int i = 0; i < 9; ++i) store(a[i], A[i / 3][i % 3]);
    for (int i = 0; i < 4; ++i) store(rotation[i], q[i]);
    store(is_lost, select<V>(lost, one, zero));
    for (size_t lane = 0; lane < 4; ++lane) {
        if (is_lost[lane] == 0) continue;
        double matrix[9], result[4];
        for (int i = 0; i < 9; ++i) matrix[i] = a[i][lane];
        exact(matrix, result);
        for (int i = 0; i < 4; ++i) rotation[i][lane] = result[i];
    }
    for (int i = 0; i < 4; ++i) q[i] = load<V>(rotation[i]);
}

// The rotation vector of a unit quaternion, 2 log q, of the representative with w >= 0; returns t2 below. With t the
// tangent of a quarter of the angle it is v 4 atan(t) / (t (1 + w)), t2 = t^2 = |v|^2 / (1 + w)^2 <= 1; atan by halving
// the angle once more and a polynomial (Chebyshev points, error below 1e-16).
template <class V>
SUNDER_INLINE V rotation_vector(const V (&q)[4], V (&out)[3]) {
    constexpr double kArcTangent[] = {1.0,
                                      -0.3333333333333312,
                                      0.19999999999940837,
                                      -0.14285714279244968,
                                      0.11111110744657099,
                                      -0.09090896801472813,
                                      0.07692045194561481,
                                      -0.06662950246036792,
                                      0.05846866752275139,
                                      -0.05035049795312439,
                                      0.03796390316111083,
                                      -0.017803896394812564};
    const V zero = {}, one = zero + 1.0, sign = select<V>(q[3] < zero, -one, one);
    const V w1 = one + sign * q[3];
    const V t2 = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]) / (w1 * w1), root1 = one + root(one + t2);
    const V u = t2 / (root1 * root1);
    V series = zero + kArcTangent[11];
    for (int i = 10; i >= 0; --i) series = kArcTangent[i] + u * series;
    const V factor = sign * (8.0 * series / (root1 * w1));
    for (int i = 0; i < 3; ++i) out[i] = factor * q[i];
    return t2;
}

}  // namespace
}  // namespace sunder
