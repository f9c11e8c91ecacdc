// Exact angular momentum a piece (replaces Choi 2014, section 3.3, which is exact only to first order in the step).
#pragma once

#include <concepts>
#include <span>
#include <vector>

#include "solver/data/frame_state.h"
#include "solver/scene/live_topology.h"

namespace sunder {

/// Momentum of one piece about its own centre of mass.
struct PieceMomentum {
    Vec3 center = Vec3::Zero();    // m
    Vec3 velocity = Vec3::Zero();  // of the centre, m/s
    Vec3 angular = Vec3::Zero();   // L = sum m r x v + H_j w_j, kg m2/s
    Mat3 inertia = Mat3::Zero();   // sum H_j - m [r]x [r]x, kg m2
    double mass = 0;               // kg
};

/// Inertia tensor H = D (tr(M) I - M) D^T of an ellipsoid of moment M that is turned by `rotation`, kg m2.
Sym3 turned_inertia(const Quat& rotation, const Sym3& moment);

/// `inertia_of(j)`: what a particle contributes besides its mass, its ellipsoid's tensor, kg m2.
template <std::invocable<ParticleId> InertiaOf>
PieceMomentum piece_momentum(const SimulationMesh& rest, const InertiaOf& inertia_of,
                             std::span<const ParticleId> particles, std::span<const Vec3> position,
                             std::span<const Vec3> velocity, std::span<const Vec3> angular_velocity) {
    PieceMomentum p;
    const Vec3 origin = position[particles.front()];  // relative sums: exact far from the world's origin
    for (const ParticleId j : particles) {
        p.mass += rest.mass[j];
        p.center += rest.mass[j] * (position[j] - origin);
        p.velocity += rest.mass[j] * velocity[j];
    }
    p.center = origin + p.center / p.mass;
    p.velocity /= p.mass;
    for (const ParticleId j : particles) {
        const Sym3 inertia = inertia_of(j);
        const Vec3 r = position[j] - p.center;
        p.angular += rest.mass[j] * r.cross(velocity[j] - p.velocity) + product(inertia, angular_velocity[j]);
        p.inertia += to_matrix(inertia) + rest.mass[j] * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
    }
    return p;
}

/// Where they are known: `inertia` (n_particles).
inline PieceMomentum piece_momentum(const SimulationMesh& rest, std::span<const Sym3> inertia,
                                    std::span<const ParticleId> particles, std::span<const Vec3> position,
                                    std::span<const Vec3> velocity, std::span<const Vec3> angular_velocity) {
    const auto known = [&](ParticleId j) -> const Sym3& { return inertia[j]; };
    return piece_momentum(rest, known, particles, position, velocity, angular_velocity);
}

/// H^-1 L, rad/s: 0 about axes without inertia (of a point).
Vec3 rigid_spin(const PieceMomentum& piece, const Vec3& angular);

/// Adds the rigid spin H^-1 (wanted - L) to the piece. A piece without inertia about some axis (a point) is not turned
/// about it. Where L^T H^-1 L / 2 would come to more than `most_energy` (J), and to more than it is, only as much of
/// the spin is added as keeps it below both.
void set_angular_momentum(const SimulationMesh& rest, std::span<const Sym3> inertia,
                          std::span<const ParticleId> particles, const Vec3& wanted, double most_energy,
                          std::span<const Vec3> position, std::span<Vec3> io_velocity,
                          std::span<Vec3> io_angular_velocity);

}  // namespace sunder
