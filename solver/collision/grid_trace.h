// Walks through the distances to a mesh, of a grid or a SurfaceField: out of it, and through walls of it.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "solver/collision/grid_distance.h"

namespace sunder {

/// Unit direction in which the distance grows; where it has none, away from the middle of the mesh.
template <class Field>
Vec3 way_out(const Field& field, const GridSample& at, const Vec3& x) {
    const double slope = at.gradient.norm();
    if (slope > 1e-6) return at.gradient / slope;
    const Vec3 outward = x - 0.5 * (field.bounds.min + field.bounds.max);
    const double length = outward.norm();
    return length > 1e-6 * field.voxel_size ? Vec3(outward / length) : Vec3::UnitZ();
}

struct SurfacePoint {
    Vec3 point, normal;  // in the field's frame, normal outwards
};

/// Where a wall of the mesh begins that stands between `from` (outside) and `to`: the straight way enters the mesh
/// and has left it by `to`, or is already nearer to the other side.
template <class Field>
std::optional<SurfacePoint> wall_between(const Field& field, const Vec3& from, const GridSample& at_from,
                                         const Vec3& to) {
    constexpr int kMostSteps = 64;
    const double least = 0.05 * field.voxel_size;  // a shorter step than this would not end
    const Vec3 way = to - from;
    const double length = way.norm();
    double s = at_from.distance;
    for (int k = 0; k < kMostSteps && s < length; ++k) {
        const Vec3 x = from + (s / length) * way;
        const GridSample at = sample(field, x);
        if (at.distance <= 0) {
            const Vec3 n = way_out(field, at, x);
            const GridSample end = sample(field, to);
            const bool through = n.dot(way) < 0 && (end.distance > 0 || end.gradient.dot(n) < 0);
            if (!through) return std::nullopt;
            return SurfacePoint{x - at.distance * n, n};
        }
        s += std::max(at.distance, least);
    }
    return std::nullopt;
}

/// From the field's frame to the world.
inline Manifold in_world(Manifold m, const Pose& pose) {
    for (int k = 0; k < m.count; ++k) {
        Separation& s = m.points[k];
        s.normal = pose.orientation * s.normal;
        s.point_a = pose.apply(s.point_a);
        s.point_b = pose.apply(s.point_b);
    }
    return m;
}

}  // namespace sunder
