// How a triangle of an animated mesh lies.
#pragma once

#include <algorithm>
#include <span>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// Along its first edge, across it in its plane, along its normal.
inline Mat3 triangle_axes(std::span<const Vec3> position, const Triangle& t) {
    const Vec3 along = position[t[1]] - position[t[0]];
    const Vec3 normal = along.cross(position[t[2]] - position[t[0]]).normalized();
    Mat3 axes;
    axes.col(0) = along.normalized(), axes.col(1) = normal.cross(axes.col(0)), axes.col(2) = normal;
    return axes;
}

/// Whether it has no plane. `diagonal`: of the mesh's box, m.
inline bool is_flat(std::span<const Vec3> position, const Triangle& t, double diagonal) {
    // Of the diagonal, the height of a triangle that is flat: as single precision rounds places on its scale.
    constexpr double kFlatHeight = 1e-7;
    const Vec3 &a = position[t[0]], &b = position[t[1]], &c = position[t[2]];
    const double longest = std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
    return !((b - a).cross(c - a).norm() > kFlatHeight * diagonal * longest);
}

}  // namespace sunder
