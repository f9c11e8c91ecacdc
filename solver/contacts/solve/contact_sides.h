// What contacts of a batch have on their two sides, and what pushes change of it. Included by kernels that are compiled
// once for each instruction set, as lanes.h is.
#pragma once

#include "solver/contacts/solve/contact_kernels.h"
#include "solver/lanes/lane_vectors.h"

namespace sunder {
namespace {

// A batch has eight lanes, as many as `Lanes`; of a narrow one the first four are visited, of one contact the first.
using Narrow = Float4;
using Single = float;
template <class L>
constexpr size_t kWidth = sizeof(L) / sizeof(float);

// Of one contact x, y and z go side by side.
template <>
struct VectorOf<Single> {
    Float4 xyz;  // and what comes along

    VectorOf() = default;
    SUNDER_INLINE explicit VectorOf(Float4 v) : xyz(v) {}
    SUNDER_INLINE VectorOf(Single x, Single y, Single z) : xyz{x, y, z, 0} {}
    friend SUNDER_INLINE VectorOf operator+(VectorOf a, VectorOf b) { return VectorOf(a.xyz + b.xyz); }
    friend SUNDER_INLINE VectorOf operator-(VectorOf a, VectorOf b) { return VectorOf(a.xyz - b.xyz); }
    friend SUNDER_INLINE VectorOf operator-(VectorOf a) { return VectorOf(-a.xyz); }
    friend SUNDER_INLINE VectorOf operator*(Single s, VectorOf a) { return VectorOf(s * a.xyz); }
    friend SUNDER_INLINE Single dot(VectorOf a, VectorOf b) {
        const Float4 products = a.xyz * b.xyz;
        return products[0] + products[1] + products[2];
    }
    friend SUNDER_INLINE VectorOf cross(VectorOf a, VectorOf b) {
        const auto yzx = [](Float4 v) { return __builtin_shufflevector(v, v, 1, 2, 0, 3); };
        const auto zxy = [](Float4 v) { return __builtin_shufflevector(v, v, 2, 0, 1, 3); };
        return VectorOf(yzx(a.xyz) * zxy(b.xyz) - zxy(a.xyz) * yzx(b.xyz));
    }
};

template <>
struct SymmetricOf<Single> {
    Float4 columns[3];

    friend SUNDER_INLINE VectorOf<Single> operator*(const SymmetricOf& m, VectorOf<Single> v) {
        return VectorOf<Single>(m.columns[0] * v.xyz[0] + m.columns[1] * v.xyz[1] + m.columns[2] * v.xyz[2]);
    }
};

template <size_t n>
SUNDER_INLINE void store3(float (*rows)[n], VectorOf<Single> v) {
    for (int i = 0; i < 3; ++i) rows[i][0] = v.xyz[i];
}

// What a contact has on one of its sides.
template <class L>
struct Side {
    using Width = L;
    VectorOf<L> moved, lever, arm;
    VectorOf<L> shift, turn, spin;
    L own, orbit_share, whole;
    SymmetricOf<L> J;
};

// The same where it is rigid: its movable is all of its piece.
template <class L>
struct RigidSide {
    using Width = L;
    VectorOf<L> moved, arm, spin;
    L own;
    SymmetricOf<L> J;
};

template <class L>
SUNDER_INLINE void take_side(const ContactArrays& a, const ContactBatch& c, int which, Side<L>& o_side) {
    const float *movables = a.movables->moved, *pieces = a.pieces->shift;
    L m[2][4], p[4][4];
    for (size_t k = 0; k < 2; ++k) gather4<1>(movables, c.movable[which], 4 * k, m[k]);
    for (size_t k = 0; k < 4; ++k) gather4<1>(pieces, c.piece[which], 4 * k, p[k]);
    o_side = {{m[0][0], m[0][1], m[0][2]},
              {m[1][0], m[1][1], m[1][2]},
              load3<L>(c.arm[which]),
              {p[0][0], p[0][1], p[0][2]},
              {p[1][0], p[1][1], p[1][2]},
              {p[2][0], p[2][1], p[2][2]},
              m[0][3],
              m[1][3],
              p[0][3],
              {p[1][3], p[2][3], p[3][0], p[3][1], p[3][2], p[3][3]}};
}

template <class L>
SUNDER_INLINE void take_side(const ContactArrays& a, const ContactBatch& c, int which, RigidSide<L>& o_side) {
    L m[4], p[4][4];
    gather4<1>(a.movables->moved, c.movable[which], 0, m);
    for (size_t k = 1; k < 4; ++k) gather4<1>(a.pieces->shift, c.piece[which], 4 * k, p[k]);
    o_side = {{m[0], m[1], m[2]},
              load3<L>(c.arm[which]),
              {p[2][0], p[2][1], p[2][2]},
              m[3],
              {p[1][3], p[2][3], p[3][0], p[3][1], p[3][2], p[3][3]}};
}

SUNDER_INLINE SymmetricOf<Single> inertia_of(Float4 turn_xx, Float4 spin_yy, Float4 zz_xy_xz_yz) {
    const Float4 m = zz_xy_xz_yz;
    return {Float4{turn_xx[3], m[1], m[2], 0}, Float4{m[1], spin_yy[3], m[3], 0}, Float4{m[2], m[3], m[0], 0}};
}

SUNDER_INLINE void take_side(const ContactArrays& a, const ContactBatch& c, int which, Side<Single>& o_side) {
    using V = VectorOf<Single>;
    const float *movable = a.movables->moved + c.movable[which][0], *piece = a.pieces->shift + c.piece[which][0];
    const auto m = load<Float4>(movable), lever = load<Float4>(movable + 4);
    const auto shift = load<Float4>(piece), turn = load<Float4>(piece + 4), spin = load<Float4>(piece + 8);
    o_side = {V(m),
              V(lever),
              load3<Single>(c.arm[which]),
              V(shift),
              V(turn),
              V(spin),
              m[3],
              lever[3],
              shift[3],
              inertia_of(turn, spin, load<Float4>(piece + 12))};
}

SUNDER_INLINE void take_side(const ContactArrays& a, const ContactBatch& c, int which, RigidSide<Single>& o_side) {
    using V = VectorOf<Single>;
    const float *movable = a.movables->moved + c.movable[which][0], *piece = a.pieces->shift + c.piece[which][0];
    const auto m = load<Float4>(movable), turn = load<Float4>(piece + 4), spin = load<Float4>(piece + 8);
    o_side = {V(m), load3<Single>(c.arm[which]), V(spin), m[3], inertia_of(turn, spin, load<Float4>(piece + 12))};
}

template <class S>
SUNDER_INLINE S side_of(const ContactArrays& a, const ContactBatch& c, int which) {
    S side;
    take_side(a, c, which, side);
    return side;
}

// What a push changes.
template <class L>
struct Change {
    VectorOf<L> moved, shift, turn, spin;
};

template <class L>
struct RigidChange {
    VectorOf<L> moved, spin;
};

// By an impulse f at the touching point.
template <class L>
SUNDER_INLINE Change<L> by_push(const Side<L>& s, VectorOf<L> f) {
    const VectorOf<L> by_arm = s.J * cross(s.arm, f), by_lever = s.J * cross(s.lever, f);
    return {s.own * f, s.whole * f, by_arm + s.orbit_share * by_lever, by_arm + by_lever};
}

template <class L>
SUNDER_INLINE RigidChange<L> by_push(const RigidSide<L>& s, VectorOf<L> f) {
    return {s.own * f, s.J * cross(s.arm, f)};
}

// Of the touching point.
template <class L>
SUNDER_INLINE VectorOf<L> displacement(const Side<L>& s, const Change<L>& by) {
    return by.moved + by.shift + cross(by.turn, s.lever) + cross(by.spin, s.arm);
}

template <class L>
SUNDER_INLINE VectorOf<L> displacement(const RigidSide<L>& s, const RigidChange<L>& by) {
    return by.moved + cross(by.spin, s.arm);
}

template <class L>
SUNDER_INLINE VectorOf<L> moved(const Side<L>& s) {
    return displacement(s, {s.moved, s.shift, s.turn, s.spin});
}
template <class L>
SUNDER_INLINE VectorOf<L> moved(const RigidSide<L>& s) {
    return displacement(s, {s.moved, s.spin});
}

template <class L>
SUNDER_INLINE void turn_by(const Side<L>& s, VectorOf<L> couple, Change<L>& io) {
    const VectorOf<L> turned = s.J * couple;
    io.turn = io.turn + turned;
    io.spin = io.spin + turned;
}
template <class L>
SUNDER_INLINE void turn_by(const RigidSide<L>& s, VectorOf<L> couple, RigidChange<L>& io) {
    io.spin = io.spin + s.J * couple;
}

// Adds to the first three numbers from `offset` on of the records of the lanes, one after the other: two lanes may have
// the same record.
template <class L>
SUNDER_INLINE void scatter_add(float* records, const uint32_t* lanes, size_t offset, VectorOf<L> v) {
    const auto add = [&](uint32_t lane, Float4 row) {
        float* to = records + lane + offset;
        store(to, load<Float4>(to) + row);
    };
    [[maybe_unused]] L rows[4];
    if constexpr (kWidth<L> == 1) {
        add(lanes[0], Float4{v.xyz[0], v.xyz[1], v.xyz[2], 0});
    } else if constexpr (kWidth<L> == 4) {
        transpose(v.x, v.y, v.z, all<L>(0), rows);
        for (int i = 0; i < 4; ++i) add(lanes[i], rows[i]);
    } else {
        transpose({v.x, v.y, v.z, all<L>(0)}, rows);
        for (int i = 0; i < 4; ++i) add(lanes[i], low(rows[i]));
        for (int i = 0; i < 4; ++i) add(lanes[i + 4], high(rows[i]));
    }
}

template <class L>
SUNDER_INLINE void add(const ContactArrays& a, const ContactBatch& c, int which, const Change<L>& by) {
    scatter_add(a.movables->moved, c.movable[which], 0, by.moved);
    scatter_add(a.pieces->shift, c.piece[which], 0, by.shift);
    scatter_add(a.pieces->shift, c.piece[which], 4, by.turn);
    scatter_add(a.pieces->shift, c.piece[which], 8, by.spin);
}
template <class L>
SUNDER_INLINE void add(const ContactArrays& a, const ContactBatch& c, int which, const RigidChange<L>& by) {
    scatter_add(a.movables->moved, c.movable[which], 0, by.moved);
    scatter_add(a.pieces->shift, c.piece[which], 8, by.spin);
}

}  // namespace
}  // namespace sunder
