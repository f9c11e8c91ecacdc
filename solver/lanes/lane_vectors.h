// Vectors and symmetric matrices side by side: of four doubles, or of what the including file defines as SUNDER_LANES.
// Included by kernels that are compiled once for each instruction set, as lanes.h is.
#pragma once

#ifndef SUNDER_LANES
#define SUNDER_LANES Double4
#endif

#include <type_traits>

#include "solver/lanes/lanes.h"

namespace sunder {
namespace {

using Lanes = SUNDER_LANES;
using LaneMask = Mask<Lanes>;
using Number = std::remove_cvref_t<decltype(low(Lanes())[0])>;

constexpr size_t kLanes = sizeof(Lanes) / sizeof(Number);
constexpr Number kTiny = sizeof(Number) == 8 ? 1e-300 : 1e-30;  // keeps 0/0 out

template <class L = Lanes>
SUNDER_INLINE L all(Number x) {
    constexpr size_t n = sizeof(L) / sizeof(Number);
    Number lanes[n];
    for (Number& lane : lanes) lane = x;
    return load<L>(lanes);
}
template <class L>
SUNDER_INLINE L absolute(L x) {
    return select<L>(x < all<L>(0), -x, x);
}
template <class L>
SUNDER_INLINE L larger(L x, L y) {
    return maximum(y, x);
}

template <class L>
struct VectorOf {
    L x, y, z;

    friend SUNDER_INLINE VectorOf operator+(VectorOf a, VectorOf b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend SUNDER_INLINE VectorOf operator-(VectorOf a, VectorOf b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend SUNDER_INLINE VectorOf operator-(VectorOf a) { return {-a.x, -a.y, -a.z}; }
    friend SUNDER_INLINE VectorOf operator*(L s, VectorOf a) { return {s * a.x, s * a.y, s * a.z}; }
    friend SUNDER_INLINE L dot(VectorOf a, VectorOf b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    friend SUNDER_INLINE VectorOf cross(VectorOf a, VectorOf b) {
        return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    }
};
using V3 = VectorOf<Lanes>;

SUNDER_INLINE V3 select3(LaneMask m, V3 yes, V3 no) {
    return {select<Lanes>(m, yes.x, no.x), select<Lanes>(m, yes.y, no.y), select<Lanes>(m, yes.z, no.z)};
}
/// Of three rows; where these have more lanes than L, the first ones.
template <class L = Lanes, size_t n>
SUNDER_INLINE VectorOf<L> load3(const Number (*rows)[n]) {
    static_assert(n >= sizeof(L) / sizeof(Number));
    return {load<L>(rows[0]), load<L>(rows[1]), load<L>(rows[2])};
}
template <class L, size_t n>
SUNDER_INLINE void store3(Number (*rows)[n], VectorOf<L> v) {
    static_assert(n >= sizeof(L) / sizeof(Number));
    store(rows[0], v.x), store(rows[1], v.y), store(rows[2], v.z);
}

template <class L>
struct SymmetricOf {
    L xx, yy, zz, xy, xz, yz;

    friend SUNDER_INLINE VectorOf<L> operator*(const SymmetricOf& m, VectorOf<L> v) {
        return {m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
                m.xz * v.x + m.yz * v.y + m.zz * v.z};
    }
};
using Sym = SymmetricOf<Lanes>;

// Two tangents that are orthonormal with the unit vector n, without a branch on which axis is smallest (Duff et al.
// 2017).
template <class L>
struct TangentsOf {
    VectorOf<L> first, second;
};
template <class L>
SUNDER_INLINE TangentsOf<L> tangents_of(VectorOf<L> n) {
    const auto one = all<L>(1);
    const L sign = select<L>(n.z < all<L>(0), -one, one);
    const L a = -one / (sign + n.z), b = n.x * n.y * a;
    return {{one + sign * n.x * n.x * a, sign * b, -(sign * n.x)}, {b, sign + n.y * n.y * a, -n.y}};
}

}  // namespace
}  // namespace sunder
