// Kernels that copy into lanes and out of them: rest shapes and particles. For sweep_kernels.cpp alone.
#pragma once

#include "solver/data/ids.h"
#include "solver/lanes/lane_matrices.h"
#include "solver/matching/sweep_kernels.h"

namespace sunder {
namespace {

SUNDER_INLINE void put_moment(const double* const (&moments)[4], const Double4& weight, size_t lane,
                              SweepRow<float>& o_row) {
    Double4 first[4], last[4];
    gather_numbers(moments, 0, first);
    gather_numbers(moments, 2, last);
    for (int i = 0; i < 4; ++i) put_numbers(weight * first[i], o_row.moment[i] + lane);
    for (int i = 2; i < 4; ++i) put_numbers(weight * last[i], o_row.moment[2 + i] + lane);
}
template <class Row>
SUNDER_INLINE void put_moment(const double* const (&)[4], const Double4&, size_t, Row&) {}

template <class Row>
void expand(const ShapeRecords& s, const uint32_t* row_begin, Row* rows, size_t begin, size_t end) {
    constexpr size_t kNumbers = ShapeRecords::kNumbers;
    static constexpr double kPadding[6] = {};  // a member's four numbers, or a moment's six
    for (size_t block = begin; block < end; ++block) {
        uint32_t slot[8], last[8];
        for (size_t lane = 0; lane < 8; ++lane) {
            const uint32_t g = s.particle[8 * block + lane];
            slot[lane] = g == kNone ? 0 : s.begin[g], last[lane] = g == kNone ? 0 : s.end[g];
        }
        for (size_t r = row_begin[block]; r < row_begin[block + 1]; ++r)
            for (size_t lane = 0; lane < 8; lane += 4) {
                const double *own[4], *twin[4], *moment[4];
                for (size_t i = 0; i < 4; ++i) {
                    const uint32_t at = slot[lane + i];
                    const bool is_member = at < last[lane + i];
                    own[i] = is_member ? s.members + kNumbers * at : kPadding;
                    twin[i] = is_member ? s.members + kNumbers * s.twin[at] : kPadding;
                    moment[i] = is_member ? s.moments + 6 * s.member[at] : kPadding;
                    slot[lane + i] = at + is_member;
                }
                Double4 first[4], other[4];
                gather_numbers(own, 0, first);
                gather_numbers(twin, 0, other);
                put_numbers(first[3], rows[r].weight + lane);
                for (int i = 0; i < 3; ++i) {
                    put_numbers(first[i], rows[r].q[i] + lane);
                    put_numbers(other[i], rows[r].q_other[i] + lane);
                }
                put_moment(moment, first[3], lane, rows[r]);
            }
    }
}

SUNDER_INLINE void normalize(Double4 (&q)[4]) {
    const Double4 norm = root((q[0] * q[0] + q[2] * q[2]) + (q[1] * q[1] + q[3] * q[3]));
    for (int i = 0; i < 4; ++i) q[i] = q[i] / norm;
}

// Where the records of four lanes are; of padding `padding`.
template <class Record>
SUNDER_INLINE void find_records(const uint32_t* particle, double* records, double* padding, double* (&out)[4]) {
    constexpr size_t kNumbers = sizeof(Record) / sizeof(double);
    for (size_t i = 0; i < 4; ++i) out[i] = particle[i] == kNone ? padding : records + kNumbers * particle[i];
}

constexpr size_t kPlaceOfTurn = offsetof(MovingRecord, d) / sizeof(double);
constexpr size_t kPlaceOfInertial = offsetof(MovingRecord, x_inertial) / sizeof(double);
constexpr size_t kPlaceOfInertialTurn = offsetof(MovingRecord, d_inertial) / sizeof(double);

void take_in(const JacobiRecords& s, SweepParticle<float>* particles, JacobiParticles* jacobi, size_t begin,
             size_t end) {
    MovingRecord padding = {{}, 0, {0, 0, 0, 1}, {}, 0, {0, 0, 0, 1}};
    for (size_t first = 8 * begin; first < 8 * end; first += 4) {
        double *records[4], *origins[4];
        find_records<MovingRecord>(s.particle + first, s.moving->x, padding.x, records);
        find_records<MovingRecord>(s.origin + first, s.moving->x, padding.x, origins);
        for (size_t i = 0; i < 4; ++i) {
            SweepParticle<float>& to = particles[first + i];
            const float mass = to.mass;
            put_numbers(load<Double4>(records[i]) - load<Double4>(origins[i]), to.x);
            to.mass = mass;
            put_numbers(load<Double4>(records[i] + kPlaceOfTurn), to.d);
        }
        JacobiParticles& p = jacobi[first / 8];
        const size_t lane = first % 8;
        Double4 x[4], origin[4], d[4];
        gather_numbers({records[0], records[1], records[2], records[3]}, kPlaceOfInertial, x);
        gather_numbers({origins[0], origins[1], origins[2], origins[3]}, 0, origin);
        gather_numbers({records[0], records[1], records[2], records[3]}, kPlaceOfInertialTurn, d);
        for (int i = 0; i < 3; ++i) put_numbers(x[i] - origin[i], p.x_inertial[i] + lane);
        for (int i = 0; i < 4; ++i) put_numbers(d[i], p.d_inertial[i] + lane);
        for (size_t i = 0; i < 4; ++i)
            p.free[lane + i] = records[i] != padding.x && s.role[s.particle[first + i]] == Role::free ? 1.0f : 0.0f;
        for (int i = 0; i < 3; ++i) store(p.x_moved[i] + lane, Float4{});
    }
}

void take_in_for_newton(const NewtonRecords& s, NewtonParticles* newton, SweepParticle<double>* particles,
                        EllipsoidRecord* ellipsoids, size_t begin, size_t end) {
    using V = Double4;
    static constexpr MovingRecord kNobody = {{}, 0, {0, 0, 0, 1}, {}, 0, {0, 0, 0, 1}};
    static constexpr double kNoMoment[6] = {};
    for (size_t first = 8 * begin; first < 8 * end; first += 4) {
        NewtonParticles& p = newton[first / 8];
        const size_t lane = first % 8;
        const double *records[4], *moments[4];
        for (size_t i = 0; i < 4; ++i) {
            const uint32_t j = s.particle[first + i];
            const bool is_nobody = j == kNone;
            records[i] = is_nobody ? kNobody.x : s.moving[j].x;
            moments[i] = is_nobody ? kNoMoment : s.moments + 6 * j;
            p.mass[lane + i] = is_nobody ? 0.0 : s.masses[j];
            p.free[lane + i] = is_nobody || s.role[j] != Role::free ? 0.0 : 1.0;
            p.free_turn[lane + i] = is_nobody || s.role[j] == Role::held ? 0.0 : 1.0;
            p.brace[lane + i] = is_nobody || !s.brace ? 0.0 : s.brace[j];
            p.tether[lane + i] = is_nobody || !s.tether ? 0.0 : s.tether[j];
        }
        V x[4], d[4], x_inertial[4], d_inertial[4], low[4], high[4];
        gather_numbers(records, 0, x);
        gather_numbers(records, kPlaceOfTurn, d);
        gather_numbers(records, kPlaceOfInertial, x_inertial);
        gather_numbers(records, kPlaceOfInertialTurn, d_inertial);
        for (int i = 0; i < 3; ++i) store(p.x[i] + lane, x[i]), store(p.x_inertial[i] + lane, x_inertial[i]);
        for (int i = 0; i < 4; ++i) store(p.d[i] + lane, d[i]), store(p.d_inertial[i] + lane, d_inertial[i]);
        gather_numbers(moments, 0, low);
        gather_numbers(moments, 2, high);
        const Sym<V> M = {low[0], low[1], low[2], low[3], high[2], high[3]};
        V D[3][3], DM[3][3];
        rotation_matrix(d, D);
        multiply(D, M, DM);
        const auto turned = [&](int r, int c) { return DM[r][0] * D[c][0] + DM[r][1] * D[c][1] + DM[r][2] * D[c][2]; };
        const V trace = M.xx + M.yy + M.zz;
        const V H[6] = {trace - turned(0, 0), trace - turned(1, 1), trace - turned(2, 2),
                        -turned(0, 1),        -turned(0, 2),        -turned(1, 2)};
        for (int i = 0; i < 6; ++i) store(p.inertia[i] + lane, H[i]);
        const V place[4] = {x[0], x[1], x[2], load<V>(p.mass + lane)};
        scatter4<sizeof(SweepParticle<double>) / sizeof(double)>(particles[first].x, 0, place);
        const V numbers[4][4] = {{DM[0][0], DM[0][1], DM[0][2], DM[1][0]},
                                 {DM[1][1], DM[1][2], DM[2][0], DM[2][1]},
                                 {DM[2][2], H[0], H[1], H[2]},
                                 {H[3], H[4], H[5], V{}}};
        for (size_t i = 0; i < 4; ++i)
            scatter4<sizeof(EllipsoidRecord) / sizeof(double)>(ellipsoids[first].DM, 4 * i, numbers[i]);
    }
}

void give_back(const JacobiRecords& s, const SweepParticle<float>* particles, const JacobiParticles* jacobi,
               SweepGroups<float>* groups, size_t begin, size_t end) {
    MovingRecord padding = {};
    double no_rotation[4];
    const Double4 zero = {};
    for (size_t first = 8 * begin; first < 8 * end; first += 4) {
        const size_t lane = first % 8;
        double *records[4], *rotations[4];
        find_records<double[4]>(s.particle + first, s.rotations, no_rotation, rotations);
        find_records<MovingRecord>(s.particle + first, s.moving->x, padding.x, records);
        for (size_t i = 0; i < 4; ++i)
            if (jacobi[first / 8].free[lane + i] == 0) records[i] = padding.x;

        SweepGroups<float>& g = groups[first / 8];
        Double4 R[4];
        for (int i = 0; i < 4; ++i) R[i] = wide(load<Float4>(g.rotation[i] + lane));
        normalize(R);
        scatter_numbers(rotations, 0, R);
        for (int i = 0; i < 4; ++i) put_numbers(R[i], g.rotation[i] + lane);

        const JacobiParticles& p = jacobi[first / 8];
        Double4 moved[4], d[4];
        for (int i = 0; i < 3; ++i) moved[i] = wide(load<Float4>(p.x_moved[i] + lane));
        moved[3] = zero;
        double steps[4][4];
        scatter_numbers({steps[0], steps[1], steps[2], steps[3]}, 0, moved);
        for (size_t i = 0; i < 4; ++i) {
            for (size_t k = 0; k < 4; k += 2)
                store(records[i] + k, load<Double2>(records[i] + k) + load<Double2>(steps[i] + k));
            store(steps[i], wide(load<Float4>(particles[first + i].d)));
        }
        gather_numbers({steps[0], steps[1], steps[2], steps[3]}, 0, d);
        normalize(d);
        scatter_numbers(records, kPlaceOfTurn, d);
    }
}

}  // namespace
}  // namespace sunder
