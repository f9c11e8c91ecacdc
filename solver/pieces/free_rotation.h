// Torque-free turning of a rigid body: lone fragments and rigid bodies, however fast they spin.
#pragma once

#include "solver/data/math.h"

namespace sunder {

/// A rigid body's principal frame and how it turns.
struct Turning {
    Quat frame;             // principal axes, world
    Vec3 angular_velocity;  // rad/s, world
};

/// Where a free body with angular momentum L is after h seconds. L is kept exactly; the energy L.w/2 departs from its
/// start by the square of the inner step's angle (below 0.25 rad) and does not drift, so a needle that tumbles end over
/// end cannot come out spinning about its axis. Exact for spheres and symmetric tops. `moments` > 0 about the axes of
/// `frame`, kg m2; L in world axes, kg m2/s.
///
/// The kinetic energy is split into that of a sphere, whose flow commutes with the others, and two rotations about
/// principal axes, each exact (Dullweber, Leimkuhler, McLachlan 1997).
Turning turn_freely(const Quat& frame, const Vec3& moments, const Vec3& L, double h);

}  // namespace sunder
