#include "solver/pieces/momentum.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "solver/data/invariant.h"

namespace sunder {
namespace {

// The largest t within 0 .. 1 with a + 2 b t + c t^2 <= most, or <= a where a is more; c > 0.
double share_within(double a, double b, double c, double most) {
    const double room = std::max(most - a, 0.0);
    return std::clamp((std::sqrt(b * b + c * room) - b) / c, 0.0, 1.0);
}

}  // namespace

Sym3 turned_inertia(const Quat& rotation, const Sym3& moment) {
    const Mat3 D = rotation.toRotationMatrix(), M = to_matrix(moment);
    const Mat3 H = D * (M.trace() * Mat3::Identity() - M) * D.transpose();
    return to_sym(H);
}

Vec3 rigid_spin(const PieceMomentum& piece, const Vec3& angular) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(piece.inertia);
    Vec3 inverse;
    for (int i = 0; i < 3; ++i) {
        const double h = eigen.eigenvalues()(i);
        inverse(i) = h > 1e-12 * eigen.eigenvalues()(2) ? 1.0 / h : 0.0;
    }
    const Mat3& V = eigen.eigenvectors();
    return V * inverse.cwiseProduct(V.transpose() * angular);
}

void set_angular_momentum(const SimulationMesh& rest, std::span<const Sym3> inertia,
                          std::span<const ParticleId> particles, const Vec3& wanted, double most_energy,
                          std::span<const Vec3> position, std::span<Vec3> io_velocity,
                          std::span<Vec3> io_angular_velocity) {
    const PieceMomentum p = piece_momentum(rest, inertia, particles, position, io_velocity, io_angular_velocity);
    SUNDER_ASSERT(p.mass > 0 && most_energy >= 0);
    const Vec3 missing = wanted - p.angular;
    Vec3 spin = rigid_spin(p, missing);
    const double now = p.angular.dot(rigid_spin(p, p.angular)), cross = p.angular.dot(spin), square = missing.dot(spin);
    if (square > 0 && now + 2 * cross + square > 2 * most_energy)
        spin *= share_within(now, cross, square, 2 * most_energy);
    for (const ParticleId j : particles) {
        io_velocity[j] += spin.cross(position[j] - p.center);
        io_angular_velocity[j] += spin;
    }
}

}  // namespace sunder
