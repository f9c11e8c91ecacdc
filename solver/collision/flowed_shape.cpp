#include "solver/collision/flowed_shape.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "solver/collision/ellipsoid_distance.h"

namespace sunder {
namespace {

bool is_identity(const Mat3& F) { return F == Mat3::Identity(); }

}  // namespace

ContactShape flowed_shape(const Quat& rest_orientation, const Vec3& radii, const Mat3& F_P) {
    if (is_identity(F_P)) return {rest_orientation, radii};
    const Mat3 L = F_P * rest_orientation.toRotationMatrix() * radii.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(L * L.transpose()));
    Mat3 axes = eigen.eigenvectors();
    if (axes.determinant() < 0) axes.col(0) *= -1;
    // Rounding leaves the square of a needle's thickness uncertain by 1e-16 of its length's.
    const Vec3 squared = eigen.eigenvalues().cwiseMax(1e-15 * eigen.eigenvalues()(2));
    return {Quat(axes).normalized(), squared.cwiseSqrt()};
}

double flowed_radius(const Vec3& radii, const Mat3& F_P) {
    if (is_identity(F_P)) return radii.maxCoeff();
    Eigen::SelfAdjointEigenSolver<Mat3> eigen;
    eigen.computeDirect(F_P, Eigen::EigenvaluesOnly);
    return (1 + 1e-6) * eigen.eigenvalues()(2) * radii.maxCoeff();  // its closed form is good to 1e-8
}

void FlowedShapes::update(const SimulationMesh& rest, std::span<const Mat3> F_P) {
    if (made_for_.size() != F_P.size()) {
        made_for_.assign(F_P.size(), Mat3::Zero());  // of no particle
        shape_.resize(F_P.size());
    }
    changed_.assign(F_P.size(), 0);
    for (size_t i = 0; i < F_P.size(); ++i) {
        if (made_for_[i] == F_P[i]) continue;
        made_for_[i] = F_P[i];
        shape_[i] = flowed_shape(rest.rest_orientation[i], rest.radii[i], F_P[i]);
        changed_[i] = 1;
    }
}

double FlowedShapes::fitting_gap(const SimulationMesh& rest, uint32_t i, uint32_t j) const {
    const Mat3 &F_i = made_for_[i], &F_j = made_for_[j];
    Vec3 x_i = rest.rest_position[i];
    const Vec3& x_j = rest.rest_position[j];
    if (!is_identity(F_i) || !is_identity(F_j)) x_i = x_j + 0.5 * ((F_i + F_j) * (x_i - x_j));
    const auto placed = [&](uint32_t k, const Vec3& center) {
        return Ellipsoid{center, shape_[k].orientation.toRotationMatrix(), shape_[k].radii};
    };
    return std::min(0.0, ellipsoid_distance(placed(i, x_i), placed(j, x_j)).gap);
}

}  // namespace sunder
