// Rotations as quaternions that are added up: what lies between, and how fast it turns. Sums and square roots alone.
#pragma once

#include "solver/data/math.h"

namespace sunder {

/// The one of the two quaternions of a rotation that is nearer to another.
inline Quat nearer(const Quat& q, const Quat& to) { return q.dot(to) < 0 ? Quat(-q.coeffs()) : q; }

/// Halfway from one rotation to another, the shorter way.
inline Quat between(const Quat& a, const Quat& b) { return Quat(a.coeffs() + nearer(b, a).coeffs()).normalized(); }

/// d/dt of a quaternion that turns by `angular_velocity`, rad/s, world.
inline Quat quaternion_rate(const Vec3& angular_velocity, const Quat& q) {
    return Quat(0.5 * (Quat(0, angular_velocity.x(), angular_velocity.y(), angular_velocity.z()) * q).coeffs());
}

/// How fast the rotation of a quaternion of any length turns, rad/s, world.
inline Vec3 angular_velocity_of(const Quat& q, const Quat& rate) {
    return (rate * q.conjugate()).vec() * (2 / q.squaredNorm());
}

}  // namespace sunder
