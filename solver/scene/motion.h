// Small motions: rotation vectors, driven poses, inertia of simple solids.
#pragma once

#include <cmath>

#include "solver/data/math_functions.h"
#include "solver/data/rotations.h"
#include "solver/data/source_pose.h"
#include "solver/scene/scene.h"

namespace sunder {

/// The rotation by |w| about w: exp(w/2) as a quaternion. Up to half a radian, and nearly all that turns in a step
/// turns less, by series that end below a rounding.
inline Quat rotation_of(const Vec3& w) {
    const double u = 0.25 * w.squaredNorm();  // squared half of the angle
    double sine_over_angle, cosine;           // of the half; the former halved
    if (u < 1.0 / 16) {
        sine_over_angle =
            1.0 / 2 - u * (1.0 / 12 - u * (1.0 / 240 - u * (1.0 / 10080 - u * (1.0 / 725760 - u / 79833600))));
        cosine = 1 - u * (1.0 / 2 -
                          u * (1.0 / 24 - u * (1.0 / 720 - u * (1.0 / 40320 - u * (1.0 / 3628800 - u / 479001600)))));
    } else {
        const double half = std::sqrt(u);
        const math::SineAndCosine of_half = math::sincos(half);
        sine_over_angle = 0.5 * of_half.sine / half, cosine = of_half.cosine;
    }
    return Quat(cosine, sine_over_angle * w.x(), sine_over_angle * w.y(), sine_over_angle * w.z());
}

/// 2 log(q), of the representative with w >= 0: the shortest rotation vector, rad.
inline Vec3 rotation_vector(const Quat& q) {
    const double sign = q.w() < 0 ? -1.0 : 1.0, sine = q.vec().norm();
    const double angle_over_sine = sine > 1e-8 ? 2 * math::atan2(sine, sign * q.w()) / sine : 2.0;
    return sign * angle_over_sine * q.vec();
}

/// Where a driven pose is at `share` of the frame, in [0, 1].
inline Pose interpolate(const DrivenPose& drive, double share) {
    return pose_between(drive.begin, drive.end, drive.pivot, share);
}

/// Where a pin has a particle at `share` of the frame, from its rest placement.
inline Pose pin_pose(const Scene& scene, const FrameInput& input, size_t pin, ParticleIndex i, double share) {
    if (const FrameInput::SourceDrive* source = input.pin_source(pin))
        return SourceWay(*source->begin, *source->end, source->pivot, share)
            .pose(scene.rest.fragment[i], scene.rest.rest_position[i]);
    return interpolate(input.pins[pin], share);
}

/// The shape that such a drive moves, as it is at `share` of the frame.
inline Shape shape_at(Shape shape, const DrivenPose& drive, double share) {
    if (const SurfaceDrive& s = drive.surface; s.surface)
        shape.surface = s.surface.get(), shape.share = s.begin + share * (s.end - s.begin);
    return shape;
}

/// Principal moments of inertia of a solid sphere or box about its centre, kg m2.
inline Vec3 rigid_body_inertia(const RigidBody& body) {
    if (body.shape.kind == ShapeKind::sphere)
        return Vec3::Constant(0.4 * body.mass * body.shape.radius * body.shape.radius);
    const Vec3 squared = body.shape.half_extents.cwiseProduct(body.shape.half_extents);
    return body.mass / 3.0 * (squared.sum() * Vec3::Ones() - squared);
}

}  // namespace sunder
