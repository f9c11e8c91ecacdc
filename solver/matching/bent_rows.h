// Members of four groups, row by row: what they are, and how they lie. For bent_kernels.cpp alone.
#pragma once

#include <numbers>

#include "solver/matching/bent_tension.h"

namespace sunder {
namespace {

// Of all rows: K, the weighted means of p and of places, and the squared tangent of a quarter of the farthest turn.
struct RowSums {
    M3 K;
    V center[3], mean[3], farthest;
};
SUNDER_INLINE void take_row(const BentRecords& s, const uint32_t (&groups)[4], bool is_pinned, uint32_t row,
                            const V (&cell_x)[3], const V (&cell_d)[4], const M3& axes, BentRow& o_row,
                            V (&own_shift)[3], RowSums& io_sums) {
    constexpr size_t kTurn = offsetof(MovingRecord, d) / sizeof(double);
    static constexpr double kNobody[BentRecords::kMember] = {};
    const double *members[4], *particles[4];
    for (size_t i = 0; i < 4; ++i) {
        const uint32_t slot = s.begin[groups[i]] + row;
        const bool is_member = slot < s.end[groups[i]];
        members[i] = is_member ? s.members + BentRecords::kMember * slot : kNobody;
        particles[i] = s.moving[is_member ? s.member[slot] : groups[i]].x;
    }
    V first[4], second[4], third[4], fourth[4], fifth[4], x[4], d[4];
    gather_numbers(members, 0, first);    // q, weight
    gather_numbers(members, 4, second);   // pull, mean_part
    gather_numbers(members, 8, third);    // arm, and
    gather_numbers(members, 12, fourth);  // pull_arm, offset
    gather_numbers(members, 16, fifth);   // of which the last is here, and own.shift
    V own_turn[3];
    gather_vector(members, 20, own_turn);
    gather_numbers(particles, 0, x);
    gather_numbers(particles, kTurn, d);
    const V q[3] = {first[0], first[1], first[2]}, pull[3] = {second[0], second[1], second[2]};
    const V arm[3] = {third[0], third[1], third[2]}, pull_arm[3] = {third[3], fourth[0], fourth[1]};
    const V offset[3] = {fourth[2], fourth[3], fifth[0]};
    for (int i = 0; i < 3; ++i) own_shift[i] = fifth[i + 1];
    store(o_row.weight, first[3]), store(o_row.mean_part, second[3]);
    put(q, o_row.q), put(pull, o_row.pull), put(arm, o_row.arm), put(pull_arm, o_row.pull_arm);
    put(own_turn, o_row.own_turn);

    V p[3] = {x[0] - cell_x[0], x[1] - cell_x[1], x[2] - cell_x[2]};
    if (is_pinned) {
        M3 D;
        rotation_matrix(d, D);
        for (int i = 0; i < 3; ++i) p[i] += dot(D[i], offset);
    }
    const V relative[4] = {cell_d[3] * d[0] - cell_d[0] * d[3] - (cell_d[1] * d[2] - cell_d[2] * d[1]),
                           cell_d[3] * d[1] - cell_d[1] * d[3] - (cell_d[2] * d[0] - cell_d[0] * d[2]),
                           cell_d[3] * d[2] - cell_d[2] * d[3] - (cell_d[0] * d[1] - cell_d[1] * d[0]),
                           cell_d[3] * d[3] + (cell_d[0] * d[0] + cell_d[1] * d[1] + cell_d[2] * d[2])};
    V in_world[3], turn[3], bent[3];
    io_sums.farthest = maximum(io_sums.farthest, rotation_vector(relative, in_world));
    transposed_product_of(axes, in_world, turn);
    for (int i = 0; i < 3; ++i) bent[i] = turn[i] - own_turn[i], io_sums.center[i] += second[3] * p[i];
    add_outer(bent, pull_arm, io_sums.K);
    put(p, o_row.p), put(turn, o_row.turn);
}

// Where a turn is a quarter at least, as `continued` of arc.h; K anew.
constexpr double kQuarterTurn = 0.17157287525380988;  // squared tangent of a quarter of it
inline void continue_turns(const FourShapes& shapes, size_t n_rows, BentRow* rows, M3& o_K) {
    M3 K_P;
    shapes.matrix(BentRecords::kPlasticCurvature, K_P);
    for (auto& row : o_K)
        for (V& number : row) number = V();
    const V one = V() + 1.0, pi = V() + std::numbers::pi, quarter = 0.5 * pi;
    for (size_t r = 0; r < n_rows; ++r) {
        V turn[3], own[3], arm[3], pull_arm[3], expected[3];
        get(rows[r].turn, turn), get(rows[r].own_turn, own), get(rows[r].arm, arm), get(rows[r].pull_arm, pull_arm);
        product_of(K_P, arm, expected);
        for (int i = 0; i < 3; ++i) expected[i] += own[i];
        const V t = root(dot(turn, turn));
        const Mask<V> is_far = quarter < t;
        const V other = one - 2.0 * pi / select<V>(is_far, t, one);
        const V by = select<V>(is_far, select<V>(dot(turn, expected) < t * (t - pi), other, one), one);
        for (int i = 0; i < 3; ++i) turn[i] = by * turn[i], expected[i] = turn[i] - own[i];
        put(turn, rows[r].turn);
        add_outer(expected, pull_arm, o_K);
    }
}

}  // namespace
}  // namespace sunder
