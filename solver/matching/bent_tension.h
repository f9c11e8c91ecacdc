// What of the stress of four groups resists what tilts or turns them in space (docs/theory.md, "Sheets and rods"). For
// bent_kernels.cpp alone.
#pragma once

#include <cstring>

#include "solver/lanes/lane_eigen.h"
#include "solver/matching/bent_lanes.h"

namespace sunder {
namespace {

// Four groups, as far as particles do not move them.
struct FourShapes {
    const double* shapes[4];
    uint32_t special = 0;  // 0: none holds a pinned member, or thins

    SUNDER_INLINE FourShapes(const BentRecords& s, const uint32_t (&groups)[4]) {
        for (size_t i = 0; i < 4; ++i) {
            shapes[i] = s.shapes + BentRecords::kShape * groups[i];
            uint16_t flags;
            std::memcpy(&flags, reinterpret_cast<const char*>(shapes[i]) + BentRecords::kFlags, sizeof flags);
            special |= flags;
        }
    }
    // Whether one holds a pinned member.
    SUNDER_INLINE bool any_pinned() const {
        bool any = false;
        for (size_t i = 0; special != 0 && i < 4; ++i)
            any |= reinterpret_cast<const unsigned char*>(shapes[i])[BentRecords::kFlags] != 0;
        return any;
    }
    SUNDER_INLINE V number(size_t offset) const { return gather_number(shapes, offset); }
    SUNDER_INLINE void vector(size_t offset, V (&out)[3]) const { gather_vector(shapes, offset, out); }
    SUNDER_INLINE void matrix(size_t offset, M3& out) const { gather_matrix(shapes, offset, out); }
};

// How what bends is thinner where it is drawn (BendingShape::thinning).
struct Thinning {
    V by[3], rate[3];  // of places by squares of arms, and by across_gradient
    bool is_any = false;

    Thinning() = default;
    SUNDER_INLINE Thinning(const FourShapes& shapes, const double (&at)[3][3][4]) {
        if (shapes.special == 0) return;
        const V half = -0.5 * shapes.number(BentRecords::kThinning);
        is_any = any(half < V());
        if (!is_any) return;
        M3 K;
        V extent[3];
        get(at, K);
        shapes.vector(BentRecords::kExtent, extent);
        across_gradient(K, by);
        for (int k = 0; k < 3; ++k) {
            const V strain = (1 / kMostDrawn) * (by[k] * extent[k]), left = 1.0 / root(1.0 + strain * strain);
            by[k] = half * left * by[k], rate[k] = half * (left * left * left);
        }
    }
    // To the members' own shifts, which their places are to have.
    void add_to(size_t n_rows, BentRow* rows) const {
        for (size_t r = 0; is_any && r < n_rows; ++r) {
            V arm[3], shift[3];
            get(rows[r].arm, arm), get(rows[r].r, shift);
            for (int i = 0; i < 3; ++i) shift[i] += arm[i] * arm[i] * by[i];
            put(shift, rows[r].r);
        }
    }
    // What members' forces have on K by it. `held`: of a member of unit weight.
    void push(const BentRow* rows, size_t n_rows, const M3& pull, const V (&held)[3], M3& io_moment) const {
        if (!is_any) return;
        V pushed[3] = {};
        for (size_t r = 0; r < n_rows; ++r) {
            V arm[3], left[3], own[3], force[3];
            get(rows[r].arm, arm), get(rows[r].r, left), get(rows[r].pull, own);
            product_of(pull, own, force);
            const V weight = load<V>(rows[r].weight);
            for (int i = 0; i < 3; ++i)
                pushed[i] += rate[i] * (arm[i] * arm[i] * (force[i] + weight * (held[i] * left[i])));
        }
        take_across(pushed, io_moment);
    }
    SUNDER_INLINE void in_world(const M3& axes, M3& out) const {
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) out[i][k] = is_any ? rate[k] * axes[i][k] : V();
    }
};

// Of the span, by columns: S, R S and E R S.
struct Columns {
    V span[3][3], turned[3][3], in_world[3][3];
    bool has_third;  // one of the four spans all directions

    Columns(const FourShapes& shapes, const M3& R, const M3& axes) {
        V numbers[12];
        for (size_t i = 0; i < 3; ++i) {
            V four[4];
            gather_numbers(shapes.shapes, BentRecords::kSpan + 4 * i, four);
            for (size_t n = 0; n < 4; ++n) numbers[4 * i + n] = four[n];
        }
        for (int c = 0; c < 3; ++c)
            for (int i = 0; i < 3; ++i) span[c][i] = numbers[3 * c + i], turned[c][i] = in_world[c][i] = V();
        has_third = any(V() < dot(span[2], span[2]));
        for (int c = 0; c < (has_third ? 3 : 2); ++c) {
            product_of(R, span[c], turned[c]);
            product_of(axes, turned[c], in_world[c]);
        }
    }
};

// V times a sheet's stress in its span, as far as it pulls: xx, yy, xy.
struct Tension {
    V xx, yy, xy;

    Tension(const M3& pull, const Columns& columns) {
        V by[2][3];
        for (int c = 0; c < 2; ++c) product_of(pull, columns.span[c], by[c]);
        xx = dot(columns.turned[0], by[0]), yy = dot(columns.turned[1], by[1]);
        xy = 0.5 * (dot(columns.turned[0], by[1]) + dot(columns.turned[1], by[0]));
        const V zero = {}, middle = 0.5 * (xx + yy), half = 0.5 * (xx - yy), radius = root(half * half + xy * xy);
        const V most = maximum(middle + radius, zero), least = maximum(middle - radius, zero);
        const V share =
            select<V>(zero < radius, 0.5 * (most - least) / select<V>(zero < radius, radius, zero + 1.0), zero);
        const V mean = 0.5 * (most + least);
        const Mask<V> is_thin = dot(columns.span[2], columns.span[2]) < zero + 0.5;
        xx = select<V>(is_thin, mean + share * half, zero), yy = select<V>(is_thin, mean - share * half, zero);
        xy = select<V>(is_thin, share * xy, zero);
    }
    // Of a member that pulls so.
    V on(const Columns& columns, const V (&pull)[3]) const {
        const V x = dot(columns.span[0], pull), y = dot(columns.span[1], pull);
        return x * (xx * x + 2.0 * xy * y) + yy * (y * y);
    }
};

// What turns in space resists by T = tr(s) - s, where all directions are spanned: V times stress s as far as it pulls.
struct TurnTension {
    M3 T = {};
    bool is_any = false;

    /// `is_known`: else stress is that of straight ways, which a spin draws out, and nothing is taken to resist it.
    TurnTension(const M3& pull, const Columns& columns, bool is_known) {
        is_any = is_known && columns.has_third;
        if (!is_any) return;
        const V zero = {}, counts = select<V>(zero + 0.5 < dot(columns.span[2], columns.span[2]), zero + 1.0, zero);
        V by[3][3], stress[3], most[3];
        for (int c = 0; c < 3; ++c) product_of(pull, columns.span[c], by[c]);
        const auto entry = [&](int c, int d) {
            return 0.5 * counts * (dot(columns.turned[c], by[d]) + dot(columns.turned[d], by[c]));
        };
        M3 E;
        set_identity(E);
        diagonalize({entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)}, E, stress);
        for (int i = 0; i < 3; ++i) most[i] = maximum(stress[i], zero);
        for (int i = 0; i < 3; ++i) {
            V u[3] = {};
            for (int c = 0; c < 3; ++c)
                for (int k = 0; k < 3; ++k) u[k] += columns.in_world[c][k] * E[c][i];
            const V others = most[(i + 1) % 3] + most[(i + 2) % 3];
            for (int k = 0; k < 3; ++k)
                for (int m = 0; m < 3; ++m) T[k][m] += others * (u[k] * u[m]);
        }
    }
    // Of a member that pulls so, alone: half of what its way turns.
    void add_to(const Columns& columns, const V (&pull)[3], V b, V (&io_block)[6]) const {
        if (!is_any) return;
        V arm[3] = {};
        for (int c = 0; c < 3; ++c) {
            const V part = 0.5 * dot(columns.span[c], pull);
            for (int k = 0; k < 3; ++k) arm[k] += part * columns.in_world[c][k];
        }
        M3 swept;  // rows of [arm] T
        for (int k = 0; k < 3; ++k) {
            V column[3], by[3];
            for (int i = 0; i < 3; ++i) column[i] = T[i][k];
            cross_of(arm, column, by);
            for (int i = 0; i < 3; ++i) swept[i][k] = by[i];
        }
        V rows[3][3];
        for (int i = 0; i < 3; ++i) cross_of(arm, swept[i], rows[i]);
        constexpr int kRow[6] = {0, 1, 2, 0, 0, 1}, kColumn[6] = {0, 1, 2, 1, 2, 2};
        for (int n = 0; n < 6; ++n) io_block[n] += b * rows[kRow[n]][kColumn[n]];
    }
};

}  // namespace
}  // namespace sunder
