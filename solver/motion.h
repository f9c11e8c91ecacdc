// Small motions: rotation vectors, driven poses, inertia of simple solids.
#pragma once

#include <cmath>

#include "solver/scene.h"

namespace sunder {

/// The rotation by |w| about w: exp(w/2) as a quaternion.
inline Quat rotation_of(const Vec3& w) {
    const double half = 0.5 * w.norm();
    const double s = half > 1e-8 ? 0.5 * std::sin(half) / half : 0.5 - half * half / 12;
    return Quat(std::cos(half), s * w.x(), s * w.y(), s * w.z());
}

/// 2 log(q), of the representative with w >= 0: the shortest rotation vector, rad.
inline Vec3 rotation_vector(const Quat& q) {
    const double sign = q.w() < 0 ? -1.0 : 1.0, sine = q.vec().norm();
    const double angle_over_sine = sine > 1e-8 ? 2 * std::atan2(sine, sign * q.w()) / sine : 2.0;
    return sign * angle_over_sine * q.vec();
}

/// Where a driven pose is at `share` of the frame, in [0, 1].
inline Pose interpolate(const DrivenPose& drive, double share) {
    const Vec3 from = drive.begin.apply(drive.pivot), to = drive.end.apply(drive.pivot);
    const Quat orientation = drive.begin.orientation.slerp(share, drive.end.orientation);
    return {from + share * (to - from) - orientation * drive.pivot, orientation};
}

/// Principal moments of inertia of a solid sphere or box about its centre, kg m2.
inline Vec3 rigid_body_inertia(const RigidBody& body) {
    if (body.shape.kind == ShapeKind::sphere)
        return Vec3::Constant(0.4 * body.mass * body.shape.radius * body.shape.radius);
    const Vec3 squared = body.shape.half_extents.cwiseProduct(body.shape.half_extents);
    return body.mass / 3.0 * (squared.sum() * Vec3::Ones() - squared);
}

}  // namespace sunder
