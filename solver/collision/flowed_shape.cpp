#include "solver/collision/flowed_shape.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "solver/collision/ellipsoid_distance.h"

namespace sunder {
namespace {

bool is_identity(const Mat3& F) { return F == Mat3::Identity(); }

// The farthest that a point of the hull is outside, by the way to the surface along its own direction.
double farthest_outside(const ContactShape& shape, std::span<const Vec3f> hull, const Mat3& F_P) {
    double farthest = 0;
    for (const Vec3f& rest : hull) {
        const Vec3 p = F_P * rest.cast<double>();
        const double times = (shape.orientation.conjugate() * p).cwiseQuotient(shape.radii).norm();
        if (times > 1) farthest = std::max(farthest, p.norm() * (1 - 1 / times));
    }
    return farthest;
}

}  // namespace

ContactShape flowed_shape(const Quat& rest_orientation, const Vec3& radii, const Mat3& F_P) {
    if (is_identity(F_P)) return {rest_orientation, radii, 0};
    const Mat3 L = F_P * rest_orientation.toRotationMatrix() * radii.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(L * L.transpose()));
    Mat3 axes = eigen.eigenvectors();
    if (axes.determinant() < 0) axes.col(0) *= -1;
    // Rounding leaves the square of a needle's thickness uncertain by 1e-16 of its length's.
    const Vec3 squared = eigen.eigenvalues().cwiseMax(1e-15 * eigen.eigenvalues()(2));
    return {Quat(axes).normalized(), squared.cwiseSqrt(), 0};
}

double flowed_radius(const Vec3& radii, const Mat3& F_P) {
    if (is_identity(F_P)) return radii.maxCoeff();
    Eigen::SelfAdjointEigenSolver<Mat3> eigen;
    eigen.computeDirect(F_P, Eigen::EigenvaluesOnly);
    return (1 + 1e-6) * eigen.eigenvalues()(2) * radii.maxCoeff();  // its closed form is good to 1e-8
}

RestFit rest_fit(const SimulationMesh& rest, uint32_t i, uint32_t j) {
    const auto at_rest = [&](uint32_t k) {
        return Ellipsoid{rest.rest_position[k], rest.rest_orientation[k].toRotationMatrix(), rest.radii[k]};
    };
    const Separation s = ellipsoid_distance(at_rest(i), at_rest(j));
    return {s.normal, s.gap};
}

double fitting_gap(const SimulationMesh& rest, const RestFit& fit, const Mat3& F_i, const Mat3& F_j, uint32_t i,
                   uint32_t j) {
    if (is_identity(F_i) && is_identity(F_j)) return std::min(0.0, fit.gap);
    const Mat3 F = 0.5 * (F_i + F_j);
    // F^-T n: planes go with the material.
    const Vec3 n = Vec3(fit.normal.x() * F.row(1).cross(F.row(2)) + fit.normal.y() * F.row(2).cross(F.row(0)) +
                        fit.normal.z() * F.row(0).cross(F.row(1)))
                       .normalized();
    const auto support = [&](uint32_t k, const Mat3& F_k) {
        return rest.radii[k].cwiseProduct(rest.rest_orientation[k].conjugate() * (F_k * n)).norm();
    };
    const Vec3 d = F * (rest.rest_position[i] - rest.rest_position[j]);
    return std::min(0.0, n.dot(d) - support(i, F_i) - support(j, F_j));
}

double standing_out(const ContactShape& shape, std::span<const Vec3f> hull, const Mat3& F_P, const Vec3& direction) {
    if (hull.empty()) return 0;
    const Vec3f along = (F_P.transpose() * direction).cast<float>();
    float farthest = along.dot(hull.front());
    for (const Vec3f& p : hull) farthest = std::max(farthest, along.dot(p));
    return shape.radii.cwiseProduct(shape.orientation.conjugate() * direction).norm() - farthest;
}

void FlowedShapes::update(const SimulationMesh& rest, std::span<const Mat3> F_P, const WorkerPool& workers) {
    constexpr size_t kGrain = 256;
    if (made_for_.size() != F_P.size()) {
        made_for_.assign(F_P.size(), Mat3::Zero());  // of no particle
        shape_.resize(F_P.size());
    }
    workers.for_range(F_P.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            if (made_for_[i] == F_P[i]) continue;
            made_for_[i] = F_P[i];
            shape_[i] = flowed_shape(rest.rest_orientation[i], rest.radii[i], F_P[i]);
            shape_[i].corners = farthest_outside(shape_[i], rest.hull(i), F_P[i]);
        }
    });
}

}  // namespace sunder
