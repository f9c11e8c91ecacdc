// What the stages of find_contacts have in common.
#pragma once

#include <algorithm>

#include "solver/collision/detection.h"
#include "solver/collision/first_touch.h"
#include "solver/collision/support_ascent.h"
#include "solver/data/invariant.h"

namespace sunder::detail {

inline constexpr double kRounding = 1e-9;  // boxes are grown by this share, so that no contact is lost to rounding

inline size_t n_movables(const DetectionInput& in) { return in.particles.size() + in.rigid_bodies.size(); }
inline bool is_particle(const DetectionInput& in, MovableIndex i) { return i < in.particles.size(); }
inline bool is_driven(const DetectionInput& in, MovableIndex i) {
    return i < in.role.size() && in.role[i] != Role::free;
}
inline const PlacedShape& rigid(const DetectionInput& in, MovableIndex i) {
    return in.rigid_bodies[i - in.particles.size()];
}

inline Vec3 angular_velocity(const DetectionInput& in, MovableIndex i) {
    return in.angular_velocity.empty() ? Vec3(Vec3::Zero()) : in.angular_velocity[i];
}

inline const Vec3& center(const DetectionInput& in, MovableIndex i) {
    return is_particle(in, i) ? in.particles.center[i] : rigid(in, i).pose.position;
}

/// How far turning through the step may carry the surface towards something, m: no more than the farthest point of the
/// surface is beyond the nearest.
inline double turning_reach(const DetectionInput& in, MovableIndex i) {
    if (!in.turning.empty()) return in.turning[i];
    const double angle = angular_velocity(in, i).norm() * in.duration;
    if (angle == 0) return 0;
    double nearest, farthest;
    if (is_particle(in, i)) {
        nearest = in.particles.radii[i].minCoeff();
        farthest = in.particles.radii[i].maxCoeff();
    } else {
        const Shape& shape = rigid(in, i).shape;
        farthest = bounding_radius(shape);
        nearest = shape.kind == ShapeKind::box ? shape.half_extents.minCoeff() : farthest;
    }
    return std::min(angle * farthest, farthest - nearest);
}

/// Displacement of a point at `x` over the step, as seen from a solid that goes from one pose to the other: as if the
/// solid had stayed at `begin`. Its turning bends the path; both ends are exact.
inline Vec3 shift_seen_from(const Pose& begin, const Pose& end, const Vec3& x, const Vec3& shift) {
    return begin.apply(end.inverse_apply(x + shift)) - x;
}

inline Sym3 support_matrix(const DetectionInput& in, MovableIndex i) {
    if (!in.support.empty()) return in.support[i];
    return to_sym(support_matrix(in.particles.axes(i), in.particles.radii[i]));
}

/// Holds movable i through the step, as sweep_boxes tells.
Aabb swept_box(const DetectionInput& in, MovableIndex i, const Vec3& frame);

inline void add(MovableId a, MovableId b, const Separation& s, std::vector<Contact>& out) {
    Contact c;
    c.a = a;
    c.b = b;
    c.normal = s.normal;
    c.point_a = s.point_a;
    c.point_b = s.point_b;
    c.gap = s.gap;
    out.push_back(c);
}

/// One contact at most, for pairs with a particle in them. `at(offset)`: separation with a moved by `offset`.
template <class SeparationAt>
void add_single(MovableId a, MovableId b, const SeparationAt& at, const Vec3& shift, double reach,
                std::vector<Contact>& out) {
    Separation s;
    double share;
    if (first_touch(at, shift, reach, s, share)) add(a, b, s, out);
}

/// Rigid bodies: all points of the manifold at the first touch that the step can close.
inline void add_manifold(MovableId a, MovableId b, PlacedShape shape_a, const PlacedShape& shape_b, const Vec3& shift,
                         double reach, std::vector<Contact>& out) {
    const Vec3 start = shape_a.pose.position;
    const auto manifold_at = [&](const Vec3& offset) {
        shape_a.pose.position = start + offset;
        return rigid_contacts(shape_a, shape_b);
    };
    const auto deepest_at = [&](const Vec3& offset) {
        const Manifold m = manifold_at(offset);
        SUNDER_ASSERT(m.count > 0);
        int least = 0;
        for (int k = 1; k < m.count; ++k)
            if (m.points[k].gap < m.points[least].gap) least = k;
        return m.points[least];
    };
    Separation touch;
    double share;
    if (!first_touch(deepest_at, shift, reach, touch, share)) return;
    const Manifold m = manifold_at(share * shift);
    for (int k = 0; k < m.count; ++k) {
        const Separation s = moved_back(m.points[k], share * shift);
        if (s.gap < std::max(-s.normal.dot(shift), 0.0) + reach) add(a, b, s, out);
    }
}

}  // namespace sunder::detail
