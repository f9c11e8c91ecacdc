// Compiled once for each instruction set (lanes.h).
#include "solver/material/stretch_kernels.h"

#include "solver/lanes/lane_eigen.h"
#include "solver/lanes/lane_rotation.h"

namespace sunder {
namespace {

using V = Double4;
using M3 = V[3][3];

// Members' (A) and ellipsoids' (E) part of A_pq, as group_moments.
SUNDER_INLINE void gather_moments(const StretchRecords& s, const uint32_t (&groups)[4], M3& A, M3& E) {
    constexpr size_t kTurn = offsetof(MovingRecord, d) / sizeof(double);
    static constexpr double kPadding[ShapeRecords::kNumbers] = {};
    uint32_t n_rows = 0;
    const double* centers[4];
    for (size_t i = 0; i < 4; ++i) {
        n_rows = n_rows < s.end[groups[i]] - s.begin[groups[i]] ? s.end[groups[i]] - s.begin[groups[i]] : n_rows;
        centers[i] = s.moving[groups[i]].x;
    }
    V origin[4];
    gather_numbers(centers, 0, origin);
    for (uint32_t row = 0; row < n_rows; ++row) {
        const double *members[4], *particles[4], *moments[4];
        double masses[4];
        for (size_t i = 0; i < 4; ++i) {
            const uint32_t slot = s.begin[groups[i]] + row;
            const bool is_member = slot < s.end[groups[i]];
            const uint32_t j = is_member ? s.member[slot] : groups[i];
            members[i] = is_member ? s.members + ShapeRecords::kNumbers * slot : kPadding;
            particles[i] = s.moving[j].x, moments[i] = s.moments + 6 * j, masses[i] = s.masses[j];
        }
        V x[4], d[4], member[4], first[4], last[4];
        gather_numbers(particles, 0, x);
        gather_numbers(particles, kTurn, d);
        gather_numbers(members, 0, member);
        gather_numbers(moments, 0, first);
        gather_numbers(moments, 2, last);
        const V weight = member[3], mass = weight * load<V>(masses);
        const Sym<V> moment = {weight * first[0], weight * first[1], weight * first[2],
                               weight * first[3], weight * last[2],  weight * last[3]};
        M3 D, DM;
        rotation_matrix(d, D);
        multiply(D, moment, DM);
        for (int r = 0; r < 3; ++r) {
            const V mp = mass * (x[r] - origin[r]);
            for (int c = 0; c < 3; ++c) A[r][c] += mp * member[c], E[r][c] += DM[r][c];
        }
    }
}

void measure(const StretchRecords& s, const uint32_t (&groups)[4], GroupStretches& o_stretches) {
    const double *shapes[4], *rotations[4];
    for (size_t i = 0; i < 4; ++i) {
        shapes[i] = s.shapes + StretchRecords::kShapeNumbers * groups[i];
        rotations[i] = s.rotations + 4 * groups[i];
    }
    M3 A = {}, E = {}, AQ, R;
    gather_moments(s, groups, A, E);
    multiply(A, gather_symmetric(shapes, StretchRecords::kIsotropy), AQ);
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) AQ[r][c] += s.orientation_weight * E[r][c];
    V rotation[4];
    gather_numbers(rotations, 0, rotation);
    optimal_rotation(AQ, rotation, s.exact_rotation);
    for (int i = 0; i < 4; ++i) store(o_stretches.rotation[i], rotation[i]);

    // S = V [(V^T sym(R^T A_pq) V) o Lam] V^T
    rotation_matrix(rotation, R);
    M3 U, S_pq, basis, Lam, left, inner, right;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) A[r][c] += s.stretch_weight * E[r][c];
    multiply_transposed(R, A, U);
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) S_pq[r][c] = 0.5 * (U[r][c] + U[c][r]);
    gather_matrix(shapes, StretchRecords::kV, basis);
    to_matrix(gather_symmetric(shapes, StretchRecords::kLam), Lam);
    multiply_transposed(basis, S_pq, left);
    multiply(left, basis, inner);
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) inner[r][c] = inner[r][c] * Lam[r][c];
    multiply(basis, inner, right);
    constexpr int kRow[6] = {0, 1, 2, 1, 2, 2}, kColumn[6] = {0, 1, 2, 0, 0, 1};  // the lower half, as Eigen's solver
    const V one = V() + 1.0;
    V square = {};
    for (int i = 0; i < 6; ++i) {
        const int r = kRow[i], c = kColumn[i];
        const V S = right[r][0] * basis[c][0] + right[r][1] * basis[c][1] + right[r][2] * basis[c][2];
        const V off = i < 3 ? S - one : S;
        square += i < 3 ? off * off : 2.0 * (off * off);
        store(o_stretches.S[i], S);
    }
    store(o_stretches.deviation, root(square));
}

void decompose(const GroupStretches& s, PrincipalLanes& o_principal) {
    const Sym<V> S = {load<V>(s.S[0]), load<V>(s.S[1]), load<V>(s.S[2]),
                      load<V>(s.S[3]), load<V>(s.S[4]), load<V>(s.S[5])};
    M3 E;
    V stretch[3];
    set_identity(E);
    diagonalize(S, E, stretch);
    sort_ascending(stretch, E);
    for (int i = 0; i < 3; ++i) store(o_principal.stretch[i], stretch[i]);
    for (int i = 0; i < 9; ++i) store(o_principal.directions[i], E[i % 3][i / 3]);
}

void factor(const PrincipalLanes& s, const double* const (&plastic_deformation)[4], RightFactors& o_factors) {
    M3 E, F_P, flow, F, FF, U, Q;
    V stretch[3], p[3], inverse[3];
    for (int i = 0; i < 3; ++i) stretch[i] = load<V>(s.stretch[i]);
    for (int i = 0; i < 9; ++i) E[i % 3][i / 3] = load<V>(s.directions[i]);
    gather_matrix(plastic_deformation, 0, F_P);
    to_matrix(compose(E, stretch), flow);
    multiply(flow, F_P, F);

    multiply_transposed(F, F, FF);
    set_identity(U);
    diagonalize({FF[0][0], FF[1][1], FF[2][2], FF[0][1], FF[0][2], FF[1][2]}, U, p);
    for (int i = 0; i < 3; ++i) p[i] = root(p[i]), inverse[i] = 1.0 / p[i];
    multiply(F, compose(U, inverse), Q);
    for (int i = 0; i < 3; ++i) store(o_factors.principal[i], p[i]);
    for (int i = 0; i < 9; ++i) {
        store(o_factors.directions[i], U[i % 3][i / 3]);
        store(o_factors.Q[i], Q[i % 3][i / 3]);
    }
}

}  // namespace

const StretchKernels SUNDER_KERNELS(kStretchKernels) = {measure, decompose, factor};

}  // namespace sunder
