#include "solver/collision/shape_distance.h"

#include <algorithm>
#include <limits>

#include "solver/collision/box_contacts.h"
#include "solver/collision/grid_distance.h"
#include "solver/collision/support_ascent.h"
#include "solver/collision/surface_distance.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

Aabb mesh_bounds(const Shape& shape) { return shape.surface ? SurfaceField(shape).bounds : shape.grid->bounds; }

/// Along n, from the nearest point of a zero-radius core: the ball or tube around the core of b has radius r.
Separation around_core(const Vec3& point_a, const Vec3& core_b, const Vec3& n, double r) {
    Separation s;
    s.normal = n;
    s.point_a = point_a;
    s.point_b = core_b + r * n;
    s.gap = n.dot(s.point_a - s.point_b);
    return s;
}

Separation ellipsoid_plane(const Ellipsoid& a, const Pose& plane) {
    const Vec3 n = plane.orientation * Vec3::UnitZ();
    const Vec3 Mn = detail::support_matrix(a.axes, a.radii) * n;
    const double h = std::sqrt(n.dot(Mn));
    Separation s;
    s.normal = n;
    s.gap = n.dot(a.center - plane.position) - h;
    s.point_a = a.center - Mn / h;
    s.point_b = s.point_a - s.gap * n;
    return s;
}

Separation ellipsoid_sphere(const Ellipsoid& a, const Vec3& center, double radius) {
    detail::SupportGap<false> gap;
    gap.d = a.center - center;
    gap.M_a = detail::support_matrix(a.axes, a.radii);
    const std::array<Vec3, 3> axes = {a.axes.col(0), a.axes.col(1), a.axes.col(2)};
    const auto best = detail::best_direction(gap, gap.d, axes);
    return around_core(a.center - best.s_a, center, best.n, radius);
}

/// Against a box with half extents `e` (some may be 0: a segment), swept by a ball of radius `r`.
Separation ellipsoid_rounded_box(const Ellipsoid& a, const Pose& pose, const Vec3& e, double r) {
    const Mat3 Q = pose.orientation.toRotationMatrix();
    const Mat3 axes = Q.transpose() * a.axes;  // in the frame of the box
    detail::SupportGap<true> gap;
    gap.d = Q.transpose() * (a.center - pose.position);
    gap.M_a = detail::support_matrix(axes, a.radii);
    gap.e = e;
    const Vec3 outward = gap.d - gap.d.cwiseMax(-e).cwiseMin(e);
    // Ways out of a segment lie across it; a centre on its very axis takes the first one.
    const bool segment = e.x() == 0;
    const Vec3 across = segment && (gap.d.x() != 0 || gap.d.y() != 0) ? Vec3(gap.d.x(), gap.d.y(), 0) : Vec3::UnitX();
    const std::array<Vec3, 12> candidates = {across,        Vec3::UnitY(),  Vec3::UnitZ(),  axes.col(0),
                                             axes.col(1),   axes.col(2),    Vec3(0, 1, 1),  Vec3(1, 0, 1),
                                             Vec3(1, 1, 0), Vec3(0, 1, -1), Vec3(1, 0, -1), Vec3(1, -1, 0)};
    const auto best = detail::best_direction<5>(gap, outward, candidates);
    const Vec3 deepest_a = gap.d - best.s_a;
    Vec3 deepest_b;
    for (int i = 0; i < 3; ++i) {
        const double n = best.n[i];
        deepest_b[i] = n == 0 ? std::clamp(deepest_a[i], -e[i], e[i]) : std::copysign(e[i], n);
    }
    return around_core(pose.position + Q * deepest_a, pose.position + Q * deepest_b, Q * best.n, r);
}

Separation point_box(const Vec3& point, const Pose& pose, const Vec3& e) {
    const Vec3 p = pose.inverse_apply(point);
    const Vec3 nearest = p.cwiseMax(-e).cwiseMin(e);
    const double distance = (p - nearest).norm();
    Separation s;
    s.point_a = point;
    if (distance > 0) {
        s.gap = distance;
        s.normal = pose.orientation * ((p - nearest) / distance);
    } else {  // inside: the nearest face, the first one of equals
        int face = 0;
        s.gap = -kUnbounded;
        for (int i = 0; i < 3; ++i)
            if (std::abs(p[i]) - e[i] > s.gap) {
                s.gap = std::abs(p[i]) - e[i];
                face = i;
            }
        Vec3 n = Vec3::Zero();
        n[face] = p[face] < 0 ? -1 : 1;
        s.normal = pose.orientation * n;
    }
    s.point_b = point - s.gap * s.normal;
    return s;
}

/// From a core point to `point`; where they coincide, towards `fallback`.
Separation point_core(const Vec3& point, const Vec3& core, double radius, const Vec3& fallback) {
    const Vec3 d = point - core;
    const double distance = d.norm();
    return around_core(point, core, distance > 0 ? Vec3(d / distance) : fallback, radius);
}

/// The solid a grown from its core by `r`.
Separation grown(Separation s, double r) {
    s.point_a -= r * s.normal;
    s.gap -= r;
    return s;
}

Manifold box_plane(const PlacedShape& a, const Pose& plane) {
    const Vec3 n = plane.orientation * Vec3::UnitZ(), e = a.shape.half_extents;
    Manifold m;
    for (int corner = 0; corner < 8; ++corner) {
        Separation s;
        s.normal = n;
        s.point_a =
            a.pose.apply(Vec3(corner & 1 ? e.x() : -e.x(), corner & 2 ? e.y() : -e.y(), corner & 4 ? e.z() : -e.z()));
        s.gap = n.dot(s.point_a - plane.position);
        s.point_b = s.point_a - s.gap * n;
        m.add(s);
    }
    return m;
}

}  // namespace

double Manifold::least_gap() const {
    double least = kUnbounded;
    for (int k = 0; k < count; ++k) least = std::min(least, points[k].gap);
    return least;
}

double bounding_radius(const Shape& shape) {
    switch (shape.kind) {
        case ShapeKind::plane:
            return kUnbounded;
        case ShapeKind::sphere:
            return shape.radius;
        case ShapeKind::box:
            return shape.half_extents.norm();
        case ShapeKind::capsule:
            return shape.radius + shape.half_height;
        case ShapeKind::mesh: {
            const Aabb bounds = mesh_bounds(shape);
            return bounds.max.cwiseAbs().cwiseMax(bounds.min.cwiseAbs()).norm();
        }
    }
    return kUnbounded;
}

Aabb bounding_box(const PlacedShape& placed) {
    const Shape& shape = placed.shape;
    const Mat3 Q = placed.pose.orientation.toRotationMatrix();
    Vec3 half = Vec3::Constant(kUnbounded);
    switch (shape.kind) {
        case ShapeKind::plane:
            break;
        case ShapeKind::sphere:
            half.setConstant(shape.radius);
            break;
        case ShapeKind::box:
            half = Q.cwiseAbs() * shape.half_extents;
            break;
        case ShapeKind::capsule:
            half = Q.col(2).cwiseAbs() * shape.half_height + Vec3::Constant(shape.radius);
            break;
        case ShapeKind::mesh: {
            const Aabb bounds = mesh_bounds(shape);
            const Vec3 center = placed.pose.apply(0.5 * (bounds.min + bounds.max));
            half = Q.cwiseAbs() * (0.5 * (bounds.max - bounds.min));
            return {center - half, center + half};
        }
    }
    return {placed.pose.position - half, placed.pose.position + half};
}

Separation ellipsoid_shape_distance(const Ellipsoid& a, const PlacedShape& b) {
    const Shape& shape = b.shape;
    switch (shape.kind) {
        case ShapeKind::plane:
            return ellipsoid_plane(a, b.pose);
        case ShapeKind::sphere:
            return ellipsoid_sphere(a, b.pose.position, shape.radius);
        case ShapeKind::box:
            return ellipsoid_rounded_box(a, b.pose, shape.half_extents, 0);
        case ShapeKind::capsule:
            return ellipsoid_rounded_box(a, b.pose, Vec3(0, 0, shape.half_height), shape.radius);
        case ShapeKind::mesh:
            return shape.surface ? ellipsoid_grid_contacts(a, SurfaceField(shape), b.pose).points[0]
                                 : ellipsoid_grid_contacts(a, *shape.grid, b.pose).points[0];
    }
    SUNDER_ASSERT(!"a shape of another kind");
    return {};
}

Separation point_shape_distance(const Vec3& point, const PlacedShape& b) {
    const Shape& shape = b.shape;
    switch (shape.kind) {
        case ShapeKind::plane: {
            Separation s;
            s.normal = b.pose.orientation * Vec3::UnitZ();
            s.gap = s.normal.dot(point - b.pose.position);
            s.point_a = point;
            s.point_b = point - s.gap * s.normal;
            return s;
        }
        case ShapeKind::sphere:
            return point_core(point, b.pose.position, shape.radius, Vec3::UnitZ());
        case ShapeKind::box:
            return point_box(point, b.pose, shape.half_extents);
        case ShapeKind::capsule: {
            const double z = std::clamp(b.pose.inverse_apply(point).z(), -shape.half_height, shape.half_height);
            return point_core(point, b.pose.apply(Vec3(0, 0, z)), shape.radius, b.pose.orientation * Vec3::UnitX());
        }
        case ShapeKind::mesh:
            return shape.surface ? point_grid_distance(point, SurfaceField(shape), b.pose)
                                 : point_grid_distance(point, *shape.grid, b.pose);
    }
    SUNDER_ASSERT(!"a shape of another kind");
    return {};
}

Manifold rigid_contacts(const PlacedShape& a, const PlacedShape& b) {
    Manifold m;
    if (b.shape.kind == ShapeKind::mesh)
        return b.shape.surface ? rigid_grid_contacts(a, SurfaceField(b.shape), b.pose, kUnbounded)
                               : rigid_grid_contacts(a, *b.shape.grid, b.pose, kUnbounded);
    if (a.shape.kind == ShapeKind::sphere) {
        m.add(grown(point_shape_distance(a.pose.position, b), a.shape.radius));
        return m;
    }
    SUNDER_ASSERT(a.shape.kind == ShapeKind::box);
    switch (b.shape.kind) {
        case ShapeKind::plane:
            return box_plane(a, b.pose);
        case ShapeKind::sphere:
            m.add(flipped(grown(point_shape_distance(b.pose.position, a), b.shape.radius)));
            return m;
        case ShapeKind::box:
            return box_box_contacts(a, b);
        case ShapeKind::capsule:
            return box_capsule_contacts(a, b);
        case ShapeKind::mesh:
            break;  // above
    }
    return m;
}

}  // namespace sunder
