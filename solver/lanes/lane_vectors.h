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

SUNDER_INLINE Lanes all(Number x) {
    Number lanes[kLanes];
    for (Number& lane : lanes) lane = x;
    return load<Lanes>(lanes);
}
SUNDER_INLINE Lanes absolute(Lanes x) { return select<Lanes>(x < all(0), -x, x); }
SUNDER_INLINE Lanes larger(Lanes x, Lanes y) { return maximum(y, x); }

struct V3 {
    Lanes x, y, z;
};
SUNDER_INLINE V3 operator+(V3 a, V3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
SUNDER_INLINE V3 operator-(V3 a, V3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
SUNDER_INLINE V3 operator-(V3 a) { return {-a.x, -a.y, -a.z}; }
SUNDER_INLINE V3 operator*(Lanes s, V3 a) { return {s * a.x, s * a.y, s * a.z}; }
SUNDER_INLINE Lanes dot(V3 a, V3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SUNDER_INLINE V3 cross(V3 a, V3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
SUNDER_INLINE V3 select3(LaneMask m, V3 yes, V3 no) {
    return {select<Lanes>(m, yes.x, no.x), select<Lanes>(m, yes.y, no.y), select<Lanes>(m, yes.z, no.z)};
}
SUNDER_INLINE V3 load3(const Number (&from)[3][kLanes]) {
    return {load<Lanes>(from[0]), load<Lanes>(from[1]), load<Lanes>(from[2])};
}
SUNDER_INLINE void store3(Number (&to)[3][kLanes], V3 v) { store(to[0], v.x), store(to[1], v.y), store(to[2], v.z); }

struct Sym {
    Lanes xx, yy, zz, xy, xz, yz;
};
SUNDER_INLINE V3 operator*(const Sym& m, V3 v) {
    return {m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
            m.xz * v.x + m.yz * v.y + m.zz * v.z};
}

// Two tangents that are orthonormal with the unit vector n, without a branch on which axis is smallest (Duff et al.
// 2017).
struct Tangents {
    V3 first, second;
};
SUNDER_INLINE Tangents tangents_of(V3 n) {
    const Lanes sign = select<Lanes>(n.z < all(0), all(-1), all(1));
    const Lanes a = all(-1) / (sign + n.z), b = n.x * n.y * a;
    return {{all(1) + sign * n.x * n.x * a, sign * b, -(sign * n.x)}, {b, sign + n.y * n.y * a, -n.y}};
}

}  // namespace
}  // namespace sunder
