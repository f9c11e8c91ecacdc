// The optimal stretch of one group, as the paper's equations have it: what the solver's kernels are compared with.
#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "solver/matching/optimal_stretch.h"

namespace sunder::test {

/// `A_qq` symmetric positive definite, kg m2 (the ellipsoid moments see to that; eigenvalues are kept above 1e-9 of
/// the largest so that a collapsed rest shape stays finite).
inline StretchBasis stretch_basis(const Mat3& A_qq) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(A_qq);
    Vec3 a = eigen.eigenvalues();
    a = a.cwiseMax(std::max(1e-9 * a(2), 1e-100));  // a group of no extent at all has no strain either
    StretchBasis basis;
    basis.V = eigen.eigenvectors();
    const auto entry = [&](int i, int j) { return 2.0 / (a(i) + a(j)); };
    basis.Lam = {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)};
    return basis;
}

/// S = V [(V^T S_pq V) o Lam] V^T with S_pq = sym(R^T A_pq): the symmetric S that minimises
/// sum m_i |R S q_i - p_i|^2 for the given R (Eq. 7, 8). Dimensionless; indefinite when the group is inverted.
inline Mat3 optimal_stretch(const StretchBasis& basis, const Mat3& R, const Mat3& A_pq) {
    const Mat3 unsymmetric = R.transpose() * A_pq;
    const Mat3 S_pq = 0.5 * (unsymmetric + unsymmetric.transpose());
    return basis.V * (basis.V.transpose() * S_pq * basis.V).cwiseProduct(to_matrix(basis.Lam)) * basis.V.transpose();
}

inline PrincipalStretch principal_stretch(const Mat3& S) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(S);
    return sunder::principal_stretch(eigen.eigenvalues(), eigen.eigenvectors());
}

}  // namespace sunder::test
