// Rotations by angles: what Eigen's AngleAxis, angularDistance and slerp do by libm, whose bits differ from machine to
// machine (math_functions.h).
#pragma once

#include "solver/data/math.h"

namespace sunder {

/// By `angle`, rad, about a unit vector.
Quat rotation_about(const Vec3& unit_axis, double angle);

/// The angle between two orientations, rad, in [0, pi].
double angle_between(const Quat& a, const Quat& b);

/// Where an orientation is at `share` of its way, in [0, 1], that turns steadily and the shorter way round.
Quat slerp(const Quat& from, double share, const Quat& to);

}  // namespace sunder
