// Compiled once for each instruction set (lanes.h).
#include "solver/matching/bent_kernels.h"

#include "solver/matching/bent_rows.h"

namespace sunder {
namespace {

// R of F, with one-point shear.
SUNDER_INLINE void find_rotation(const BentRecords& s, const FourShapes& shapes, const M3& F, const M3& axes,
                                 const V (&cell_d)[4], M3& R, double (&o_goal)[4][4]) {
    const V volume = shapes.number(BentRecords::kVolume), stretch = 2.0 * shapes.number(BentRecords::kMu) * volume;
    V shear[3], rotation[4] = {V(), V(), V(), V() + 1.0};
    shapes.vector(BentRecords::kShear, shear);
    const V half = 0.5 * (shear[0] + shear[1] + shear[2]);
    M3 A;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) A[i][k] = stretch * F[i][k];
    for (int i = 0; i < 3; ++i) A[i][i] += volume * (half - shear[i]);
    optimal_rotation(A, rotation, s.exact_rotation);
    rotation_matrix(rotation, R);
    // D E R E^T: R about the axes at rest, then as the fragment is turned.
    const V about[3] = {rotation[0], rotation[1], rotation[2]}, w = rotation[3];
    V v[3], by[3];
    product_of(axes, about, v);
    const V d[3] = {cell_d[0], cell_d[1], cell_d[2]};
    cross_of(d, v, by);
    V goal[4];
    for (int i = 0; i < 3; ++i) goal[i] = cell_d[3] * v[i] + w * d[i] + by[i];
    goal[3] = cell_d[3] * w - dot(d, v);
    const V one = V() + 1.0, sign = select<V>(goal[3] < V(), -one, one);
    const V unit = sign / root(goal[0] * goal[0] + goal[1] * goal[1] + goal[2] * goal[2] + goal[3] * goal[3]);
    for (int i = 0; i < 4; ++i) store(o_goal[i], unit * goal[i]);
}

void bend(const BentRecords& s, const uint32_t (&groups)[4], size_t n_rows, bool with_rates, BentGroups& o,
          BentRow* rows) {
    constexpr size_t kTurn = offsetof(MovingRecord, d) / sizeof(double);
    const FourShapes shapes(s, groups);
    const bool is_pinned = shapes.any_pinned();
    const double* cells[4];
    for (size_t i = 0; i < 4; ++i) cells[i] = s.moving[groups[i]].x;
    V cell_x[3], cell_d[4];
    gather_vector(cells, 0, cell_x);
    gather_numbers(cells, kTurn, cell_d);
    M3 rest_axes, D, axes, F = {}, R, P;
    shapes.matrix(BentRecords::kAxes, rest_axes);
    rotation_matrix(cell_d, D);
    multiply(D, rest_axes, axes);
    RowSums sums = {};
    for (size_t r = 0; r < n_rows; ++r) {
        V own_shift[3];
        take_row(s, groups, is_pinned, static_cast<uint32_t>(r), cell_x, cell_d, rest_axes, rows[r], own_shift, sums);
        put(own_shift, rows[r].r);
    }
    if (any(V() + kQuarterTurn < sums.farthest)) continue_turns(shapes, n_rows, rows, sums.K);
    put(sums.K, o.K);
    Thinning(shapes, o.K).add_to(n_rows, rows);
    for (size_t r = 0; r < n_rows; ++r) {
        BentRow& row = rows[r];
        V arm[3], bent[3], place[3], p[3], own_shift[3];
        M3 rate = {};
        get(row.arm, arm), get(row.p, p), get(row.r, own_shift);
        product_of(sums.K, arm, bent);
        find_arc(s.exact_arc, bent, arm, with_rates, place, rate);
        for (int i = 0; i < 3; ++i) p[i] -= sums.center[i];
        V in_axes[3];
        transposed_product_of(axes, p, in_axes);
        const V part = load<V>(row.mean_part);
        for (int i = 0; i < 3; ++i) {
            place[i] += own_shift[i];
            sums.mean[i] += part * place[i];
        }
        put(in_axes, row.p), put(place, row.r);
        if (!with_rates) continue;
        put(rate, row.arc_rate);
        V turn[3];
        get(row.turn, turn);
        rotation_vector_rate(turn, rate);
        put(rate, row.turn_rate);
    }
    for (size_t r = 0; r < n_rows; ++r) {
        BentRow& row = rows[r];
        V p[3], left[3], pull[3];
        get(row.p, p), get(row.r, left), get(row.pull, pull);
        for (int i = 0; i < 3; ++i) left[i] = p[i] - (left[i] - sums.mean[i]);
        add_outer(left, pull, F);
        put(left, row.r);
    }
    find_rotation(s, shapes, F, rest_axes, cell_d, R, o.rotation);
    put(axes, o.axes), put(F, o.F), put(R, o.R);
    shapes.matrix(BentRecords::kSpanned, P);
    V softness[3], Gamma[3], shift_square[3] = {}, turn_square[3] = {};
    shapes.vector(BentRecords::kSoftness, softness), shapes.vector(BentRecords::kTurnMoment, Gamma);
    for (size_t r = 0; r < n_rows; ++r) {
        BentRow& row = rows[r];
        V left[3], q[3], arm[3], turn[3], own_turn[3], in_span[3], moved[3], bent[3];
        get(row.r, left), get(row.q, q), get(row.arm, arm), get(row.turn, turn), get(row.own_turn, own_turn);
        product_of(P, q, in_span);
        product_of(F, q, moved);
        product_of(sums.K, arm, bent);
        const V weight = load<V>(row.weight);
        for (int i = 0; i < 3; ++i) {
            left[i] -= q[i] - in_span[i] + moved[i];
            turn[i] = turn[i] - own_turn[i] - bent[i];
            shift_square[i] += weight * (softness[i] * (left[i] * left[i]));
            turn_square[i] += weight * (Gamma[i] * (turn[i] * turn[i]));
        }
        put(left, row.r), put(turn, row.sigma);
    }
    put(shift_square, o.shift_square), put(turn_square, o.turn_square);
}

// Numbers without what is rounding beside the largest of them: noise times noise is denormal in single precision, which
// takes a hundred times as long (a plate of 600 fragments ran 2.5 times as long).
template <size_t n>
SUNDER_INLINE void drop_noise(V (&io)[n]) {
    constexpr double kNoise = 1e-12;
    V square[n], most = {};
    for (size_t i = 0; i < n; ++i) {
        square[i] = io[i] * io[i];
        most = maximum(most, square[i]);
    }
    const V least = (kNoise * kNoise) * most;
    for (size_t i = 0; i < n; ++i) io[i] = select<V>(square[i] < least, V(), io[i]);
}
template <size_t n, class Real>
SUNDER_INLINE void put_exact(V (&v)[n], size_t lane, Real (*to)[8]) {
    drop_noise(v);
    for (size_t i = 0; i < n; ++i) put_numbers(v[i], to[i] + lane);
}
template <class Real>
SUNDER_INLINE void put_exact(const M3& m, size_t lane, Real (*to)[3][8]) {
    V numbers[9];
    for (int i = 0; i < 9; ++i) numbers[i] = m[i / 3][i % 3];
    put_exact(numbers, lane, to[0]);
}

// m^-1; of m = 0 zero.
SUNDER_INLINE Sym<V> inverse_of(const Sym<V>& m) {
    const V c00 = m.yy * m.zz - m.yz * m.yz, c01 = m.xz * m.yz - m.xy * m.zz, c02 = m.xy * m.yz - m.xz * m.yy;
    const V det = m.xx * c00 + m.xy * c01 + m.xz * c02, zero = {};
    const V by = select<V>(zero < det, 1.0 / select<V>(zero < det, det, zero + 1.0), zero);
    return {by * c00, by * (m.xx * m.zz - m.xz * m.xz), by * (m.xx * m.yy - m.xy * m.xy), by * c01,
            by * c02, by * (m.xy * m.xz - m.xx * m.yz)};
}

// b axes S axes^T
SUNDER_INLINE void turn_block(const M3& axes, const Sym<V>& S, V b, V (&out)[6]) {
    M3 half;
    multiply(axes, S, half);
    constexpr int kRow[6] = {0, 1, 2, 0, 0, 1}, kColumn[6] = {0, 1, 2, 1, 2, 2};
    for (int i = 0; i < 6; ++i) out[i] = b * dot(half[kRow[i]], axes[kColumn[i]]);
}

// As turned_by_pressure of bending_shape.cpp, where all directions are spanned.
SUNDER_INLINE void add_turned_by_pressure(const FourShapes& shapes, V rank, const M3& R, const M3& F, V pressure,
                                          M3& io_pull) {
    const V zero = {}, volume = shapes.number(BentRecords::kVolume),
            stretch = 2.0 * volume * shapes.number(BentRecords::kMu);
    V shear[3], a[3] = {}, turn[3];
    shapes.vector(BentRecords::kShear, shear);
    const V half = 0.5 * (shear[0] + shear[1] + shear[2]);
    M3 together = {};  // R (2 mu V F + V C)^T
    for (int c = 0; c < 3; ++c) {
        const V r[3] = {R[0][c], R[1][c], R[2][c]}, f[3] = {F[0][c], F[1][c], F[2][c]};
        V by[3], drawn[3] = {stretch * f[0], stretch * f[1], stretch * f[2]};
        cross_of(r, f, by);
        drawn[c] += volume * (half - shear[c]);
        for (int i = 0; i < 3; ++i) a[i] += by[i];
        add_outer(r, drawn, together);
    }
    const V trace = together[0][0] + together[1][1] + together[2][2];
    const Sym<V> held = {trace - together[0][0],
                         trace - together[1][1],
                         trace - together[2][2],
                         -0.5 * (together[0][1] + together[1][0]),
                         -0.5 * (together[0][2] + together[2][0]),
                         -0.5 * (together[1][2] + together[2][1])};
    const Sym<V> by = inverse_of(held);
    const V factor = select<V>(zero + 2.5 < rank, pressure * stretch, zero);
    turn[0] = factor * (by.xx * a[0] + by.xy * a[1] + by.xz * a[2]);
    turn[1] = factor * (by.xy * a[0] + by.yy * a[1] + by.yz * a[2]);
    turn[2] = factor * (by.xz * a[0] + by.yz * a[1] + by.zz * a[2]);
    for (int c = 0; c < 3; ++c) {
        const V r[3] = {R[0][c], R[1][c], R[2][c]};
        V pushed[3];
        cross_of(turn, r, pushed);
        for (int i = 0; i < 3; ++i) io_pull[i][c] += pushed[i];
    }
}

// Forces of a group, and the moment that its curvature has.
struct Stress {
    M3 pull, moment;
};
SUNDER_INLINE void find_stress(const FourShapes& shapes, const BentGroups& group, const YieldingGroups* yielding,
                               const M3& RP, Stress& o) {
    M3 K, F, K_P, stretched = {};
    get(group.K, K), get(group.F, F);
    shapes.matrix(BentRecords::kPlasticCurvature, K_P);
    V flowed = {};
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) K[i][k] -= K_P[i][k];
    if (yielding) {
        M3 R, flow, bent;
        get(group.R, R), get(yielding->stretch, flow), get(yielding->K, bent);
        multiply(R, flow, stretched);
        flowed = flow[0][0] + flow[1][1] + flow[2][2];
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) K[i][k] -= bent[i][k];
    }
    const V volume = shapes.number(BentRecords::kVolume), twice_mu = 2.0 * shapes.number(BentRecords::kMu);
    M3 P;
    shapes.matrix(BentRecords::kSpanned, P);
    // To the first order in the flow R stays: R^T F and the flow are symmetric.
    const V rank = P[0][0] + P[1][1] + P[2][2], stretch = contract(RP, F) - rank - flowed;
    const V pressed = shapes.number(BentRecords::kLambda) * stretch;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            o.pull[i][k] = volume * (twice_mu * (F[i][k] - RP[i][k] - stretched[i][k]) + pressed * RP[i][k]);
    if (any(V() + 2.5 < rank)) add_turned_by_pressure(shapes, rank, RP, F, volume * pressed, o.pull);
    for (size_t c = 0; c < 9; ++c) {
        M3 line;
        shapes.matrix(BentRecords::kBending + 9 * c, line);
        o.moment[c % 3][c / 3] = contract(line, K);
    }
}

template <class Real>
SUNDER_INLINE void put_group(const FourShapes& shapes, const M3& R, const M3& axes, const M3& RP,
                             const Columns& columns, const Tension& tension, const TurnTension& turned, V b,
                             const BentLanes<Real>& to) {
    const V volume = shapes.number(BentRecords::kVolume), stretch = 2.0 * shapes.number(BentRecords::kMu) * volume;
    V shear[3], soft[3];
    shapes.vector(BentRecords::kShear, shear), shapes.vector(BentRecords::kSoftness, soft);
    const auto entry = [&](int i, int k) { return dot(RP[i], R[k]); };
    const V xx = entry(0, 0), yy = entry(1, 1), zz = entry(2, 2);
    const Sym<V> held = {volume * shear[0] + stretch * (yy + zz),
                         volume * shear[1] + stretch * (xx + zz),
                         volume * shear[2] + stretch * (xx + yy),
                         -(stretch * entry(0, 1)),
                         -(stretch * entry(0, 2)),
                         -(stretch * entry(1, 2))};
    V yields[6], softness[6];
    turn_block(axes, inverse_of(held), b * stretch * stretch, yields);
    turn_block(axes, {soft[0], soft[1], soft[2], V(), V(), V()}, V() + 1.0, softness);
    put_exact(yields, to.lane, to.groups.held);
    put_exact(softness, to.lane, to.groups.softness);
    V numbers[9], tensions[3] = {b * tension.xx, b * tension.yy, b * tension.xy};
    for (int i = 0; i < 9; ++i) numbers[i] = columns.in_world[i / 3][i % 3];
    V T[6] = {b * turned.T[0][0], b * turned.T[1][1], b * turned.T[2][2],
              b * turned.T[0][1], b * turned.T[0][2], b * turned.T[1][2]};
    put_exact(tensions, to.lane, to.groups.tension);
    if (columns.has_third) put_exact(T, to.lane, to.groups.turn_tension);
    put_exact(numbers, to.lane, to.groups.R_span[0]);
}

template <class Real>
void linearise(const BentRecords& s, const uint32_t (&groups)[4], const double (&span2)[4], size_t n_rows,
               const BentGroups& group, const BentRow* rows, const YieldingGroups* yielding,
               const BentLanes<Real>& to) {
    const FourShapes shapes(s, groups);
    const V b = load<V>(span2), k = shapes.number(BentRecords::kK);
    M3 R, P, RP, axes;
    get(group.R, R), get(group.axes, axes);
    shapes.matrix(BentRecords::kSpanned, P);
    multiply(R, P, RP);
    Stress stress;
    find_stress(shapes, group, yielding, RP, stress);
    const Columns columns(shapes, R, axes);
    const Tension tension(stress.pull, columns);
    const TurnTension turn_tension(stress.pull, columns, to.knows_stress);
    put_group(shapes, R, axes, RP, columns, tension, turn_tension, b, to);
    V across[6];  // what is not spanned, as a projection
    constexpr int kRow[6] = {0, 1, 2, 0, 0, 1}, kColumn[6] = {0, 1, 2, 1, 2, 2};
    for (int i = 0; i < 6; ++i) {
        across[i] = V() + (i < 3 ? 1.0 : 0.0);
        for (const V(&c)[3] : columns.in_world) across[i] -= c[kRow[i]] * c[kColumn[i]];
    }
    V shift_held[3], turn_held[3];  // of a member of unit weight
    shapes.vector(BentRecords::kSoftness, shift_held), shapes.vector(BentRecords::kTurnMoment, turn_held);
    for (int i = 0; i < 3; ++i) {
        if (yielding) {
            shift_held[i] = shift_held[i] * load<V>(yielding->shift_left[i]);
            turn_held[i] = turn_held[i] * load<V>(yielding->turn_left[i]);
        }
        shift_held[i] = k * shift_held[i], turn_held[i] = k * turn_held[i];
    }
    const Thinning thinning = columns.has_third ? Thinning(shapes, group.K) : Thinning();
    thinning.push(rows, n_rows, stress.pull, shift_held, stress.moment);
    V total[3] = {}, torque[3] = {};
    for (size_t r = 0; r < n_rows; ++r) {
        const BentRow& row = rows[r];
        V left[3], pull[3], p[3], arm[3], force[3], by[3], back[3];
        M3 rate;
        get(row.r, left), get(row.pull, pull), get(row.p, p), get(row.arm, arm), get(row.arc_rate, rate);
        const V weight = load<V>(row.weight);
        product_of(stress.pull, pull, force);
        for (int i = 0; i < 3; ++i) {
            force[i] += weight * (shift_held[i] * left[i]);
            total[i] += force[i];
        }
        cross_of(p, force, by);
        transposed_product_of(rate, force, back);
        for (int i = 0; i < 3; ++i) {
            torque[i] += by[i];
            for (int c = 0; c < 3; ++c) stress.moment[i][c] -= back[i] * arm[c];
        }
        BendingRow<Real>& out = to.rows[r];
        V lever[3];
        M3 swept;
        product_of(axes, p, lever);
        multiply(axes, rate, swept);
        put_exact(lever, to.lane, out.lever);
        put_exact(swept, to.lane, out.arc_rate);
    }
    if (columns.has_third) {
        M3 in_world;
        thinning.in_world(axes, in_world);
        put_exact(in_world, to.lane, to.groups.thinned);
    }
    for (size_t r = 0; r < n_rows; ++r) {
        const BentRow& row = rows[r];
        V left[3], pull[3], pull_arm[3], sigma[3], force[3], moment[3], turned[3];
        M3 rate, rate_in_world;
        get(row.r, left), get(row.pull, pull), get(row.pull_arm, pull_arm), get(row.sigma, sigma);
        get(row.turn_rate, rate);
        const V weight = load<V>(row.weight), part = load<V>(row.mean_part);
        product_of(stress.pull, pull, force);
        product_of(stress.moment, pull_arm, moment);
        for (int i = 0; i < 3; ++i) {
            force[i] = part * total[i] - (force[i] + weight * (shift_held[i] * left[i]));
            moment[i] = moment[i] + weight * (turn_held[i] * sigma[i]);
        }
        transposed_product_of(rate, moment, turned);
        V pushed[3], twisted[3];
        product_of(axes, force, pushed);
        product_of(axes, turned, twisted);
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 3; ++c) rate_in_world[i][c] = dot(rate[i], axes[c]);
        put_exact(rate_in_world, to.lane, to.rows[r].turn_rate);

        static constexpr double kNobody[BentRecords::kMember] = {};
        const double* members[4];
        for (size_t i = 0; i < 4; ++i) {
            const uint32_t slot = s.begin[groups[i]] + static_cast<uint32_t>(r);
            members[i] = slot < s.end[groups[i]] ? s.members + BentRecords::kMember * slot : kNobody;
        }
        V shift[6], turn[6];
        turn_block(axes, gather_symmetric(members, BentRecords::kShiftBlock), b, shift);
        turn_block(axes, gather_symmetric(members, BentRecords::kTurnBlock), b, turn);
        const V drawn = b * tension.on(columns, pull);
        for (int i = 0; i < 6; ++i) shift[i] += drawn * across[i];
        turn_tension.add_to(columns, pull, b, shift);
        const V zero = {};
        V numbers[5][4] = {{b * pushed[0], b * pushed[1], b * pushed[2], -b * twisted[0]},
                           {-b * twisted[1], -b * twisted[2], shift[0], shift[1]},
                           {shift[2], shift[3], shift[4], shift[5]},
                           {turn[0], turn[1], turn[2], turn[3]},
                           {turn[4], turn[5], zero, zero}};
        static_assert(sizeof(BentPull) == 20 * sizeof(double));
        for (size_t i = 0; i < 5; ++i) scatter4<20>(to.pulls[8 * r + to.lane].force, 4 * i, numbers[i]);
        for (int i = 0; i < 3; ++i) torque[i] += turned[i];
    }
    V cell[3];
    product_of(axes, torque, cell);
    double cells[3][4];
    for (int i = 0; i < 3; ++i) store(cells[i], b * cell[i]);
    for (size_t lane = 0; lane < 4; ++lane)
        for (uint32_t slot = s.begin[groups[lane]]; slot < s.end[groups[lane]]; ++slot)
            if (s.member[slot] == groups[lane]) {
                BentPull& pull = to.pulls[8 * (slot - s.begin[groups[lane]]) + to.lane + lane];
                for (int i = 0; i < 3; ++i) pull.torque[i] = cells[i][lane];
            }
}

SUNDER_INLINE V load_wide(const double* from) { return load<V>(from); }
SUNDER_INLINE V load_wide(const float* from) { return wide(load<Float4>(from)); }

template <class Real>
void add_pulls(const BentPull* pulls, const uint32_t* twin, size_t n_rows, const CgParticles<Real>& cg,
               NewtonParticles& p, BlockDiagonal<Real>& to) {
    V magnitude = {}, way = {};
    const V zero = {}, one = zero + 1.0;
    for (size_t lane = 0; lane < 8; lane += 4) {
        double sums[4][20];
        for (size_t l = 0; l < 4; ++l) {
            V sum[5] = {};
            for (size_t r = 0; r < n_rows; ++r)
                for (size_t i = 0; i < 5; ++i) sum[i] += load<V>(pulls[twin[8 * r + lane + l]].force + 4 * i);
            for (size_t i = 0; i < 5; ++i) store(sums[l] + 4 * i, sum[i]);
        }
        V n[5][4];
        for (size_t i = 0; i < 5; ++i) gather_numbers({sums[0], sums[1], sums[2], sums[3]}, 4 * i, n[i]);
        const V inverse_turn = load_wide(cg.inverse_turn + lane), inverse_shift = load_wide(cg.inverse_shift + lane);
        const Mask<V> is_free = zero < inverse_turn;
        const V drawn = select<V>(is_free, 1.0 / select<V>(is_free, inverse_turn, one), zero);
        const V free = select<V>(zero < inverse_shift, one, zero), mass = load<V>(p.mass + lane);
        const V inverse_mass = select<V>(is_free, 1.0 / select<V>(is_free, mass, one), zero);
        const Sym<V> H = sym<V>(p.inertia, lane);
        const Sym<V> inverse_inertia = inverse_of(H);
        const V own = drawn * mass;
        const Sym<V> shift = {own + n[1][2], own + n[1][3], own + n[2][0], n[2][1], n[2][2], n[2][3]};
        const Sym<V> turn = {drawn * H.xx + n[3][0], drawn * H.yy + n[3][1], drawn * H.zz + n[3][2],
                             drawn * H.xy + n[3][3], drawn * H.xz + n[4][0], drawn * H.yz + n[4][1]};
        const Sym<V> by_shift = inverse_of(shift), by_turn = inverse_of(turn);
        const auto times = [](const Sym<V>& m, const V(&v)[3], V(&out)[3]) {
            out[0] = m.xx * v[0] + m.xy * v[1] + m.xz * v[2];
            out[1] = m.xy * v[0] + m.yy * v[1] + m.yz * v[2];
            out[2] = m.xz * v[0] + m.yz * v[1] + m.zz * v[2];
        };
        const V torque[3] = {n[0][3], n[1][0], n[1][1]};
        V turned[3], residual[6], pushed[3], twisted[3], moved[3], by[3];
        times(inverse_inertia, torque, turned);
        for (int i = 0; i < 3; ++i) {
            residual[i] = load<V>(p.residual[i] + lane) + select<V>(is_free, free * (n[0][i] * inverse_mass), zero);
            residual[i + 3] = load<V>(p.residual[i + 3] + lane) + select<V>(is_free, turned[i], zero);
            pushed[i] = mass * residual[i];
        }
        for (int i = 0; i < 6; ++i) store(p.residual[i] + lane, residual[i]);
        const V spin[3] = {residual[3], residual[4], residual[5]};
        times(H, spin, twisted);
        const auto write = [&](const Sym<V>& m, V factor, Real(*at)[8]) {
            V numbers[6] = {factor * m.xx, factor * m.yy, factor * m.zz, factor * m.xy, factor * m.xz, factor * m.yz};
            put_exact(numbers, lane, at);
        };
        const V counts = select<V>(is_free, one, zero);
        write(by_shift, counts * free, to.inverse_shift);
        write(by_turn, counts, to.inverse_turn);
        write(inverse_inertia, counts, to.inverse_inertia);
        put_numbers(inverse_mass, to.inverse_mass + lane);
        times(by_shift, pushed, moved);
        times(by_turn, twisted, by);
        magnitude += counts * (free * dot(pushed, moved) + dot(twisted, by));
        for (int i = 0; i < 3; ++i) pushed[i] = mass * (load<V>(p.x_inertial[i] + lane) - load<V>(p.x[i] + lane));
        times(by_shift, pushed, moved);
        way += counts * (free * dot(pushed, moved));
    }
    p.magnitude = sum(magnitude), p.way = sum(way);
}

}  // namespace

const BentKernels SUNDER_KERNELS(kBentKernels) = {bend, linearise<float>, linearise<double>, add_pulls<float>,
                                                  add_pulls<double>};

}  // namespace sunder
