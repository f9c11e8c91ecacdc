#include "solver/optimal_stretch.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sunder {

StretchBasis stretch_basis(const Mat3& A_qq) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(A_qq);
    Vec3 a = eigen.eigenvalues();
    a = a.cwiseMax(std::max(1e-9 * a(2), 1e-100));  // a group of no extent at all has no strain either
    StretchBasis basis;
    basis.V = eigen.eigenvectors();
    const auto entry = [&](int i, int j) { return 2.0 / (a(i) + a(j)); };
    basis.Lam = {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)};
    return basis;
}

Mat3 optimal_stretch(const StretchBasis& basis, const Mat3& R, const Mat3& A_pq) {
    const Mat3 unsymmetric = R.transpose() * A_pq;
    const Mat3 S_pq = 0.5 * (unsymmetric + unsymmetric.transpose());
    return basis.V * (basis.V.transpose() * S_pq * basis.V).cwiseProduct(to_matrix(basis.Lam)) * basis.V.transpose();
}

PrincipalStretch principal_stretch(const Vec3& stretch, const Mat3& directions) {
    PrincipalStretch p{stretch, Vec3::Zero(), directions, stretch(0) > kSmallestStretch};
    for (int i = 0; i < 3; ++i) p.log_strain(i) = std::log(std::clamp(p.stretch(i), kSmallestStretch, kLargestStretch));
    return p;
}

PrincipalStretch principal_stretch(const Mat3& S) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(S);
    return principal_stretch(eigen.eigenvalues(), eigen.eigenvectors());
}

}  // namespace sunder
