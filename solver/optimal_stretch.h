// The optimal stretch of shape matching (Choi 2014, Eq. 2-8) and what is read off it.
#pragma once

#include "solver/data/math.h"

namespace sunder {

/// Eigensystem of A_qq, kept while the group's rest shape keeps: A_qq = V diag(a) V^T.
struct StretchBasis {
    Mat3 V = Mat3::Identity();
    Sym3 Lam = {1, 1, 1};  // 2 / (a_i + a_j), 1/(kg m2)
};

/// `A_qq` symmetric positive definite, kg m2 (the ellipsoid moments see to that; eigenvalues are kept above 1e-9 of
/// the largest so that a collapsed rest shape stays finite).
StretchBasis stretch_basis(const Mat3& A_qq);

/// S = V [(V^T S_pq V) o Lam] V^T with S_pq = sym(R^T A_pq): the symmetric S that minimises
/// sum m_i |R S q_i - p_i|^2 for the given R (Eq. 7, 8). Dimensionless; indefinite when the group is inverted.
Mat3 optimal_stretch(const StretchBasis& basis, const Mat3& R, const Mat3& A_pq);

/// Beyond these the logarithm of a stretch is of no use (numerics: inverted groups).
constexpr double kSmallestStretch = 0.1, kLargestStretch = 10;

/// Principal stretches and directions, ascending.
struct PrincipalStretch {
    Vec3 stretch = Vec3::Ones();         // lambda, -
    Vec3 log_strain = Vec3::Zero();      // log of lambda clamped to [0.1, 10], -
    Mat3 directions = Mat3::Identity();  // columns e_i, in the frame that R turns
    bool reliable = true;                // false: some lambda <= 0.1 (collapsed or inverted): no flow, no fracture
};
PrincipalStretch principal_stretch(const Vec3& stretch, const Mat3& directions);
PrincipalStretch principal_stretch(const Mat3& S);

}  // namespace sunder
