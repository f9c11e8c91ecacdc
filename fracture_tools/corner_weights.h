// What triangles say about the normals at their corners: unit normals and angles, many at a time.
#pragma once

#include <cstdint>
#include <span>

#include "solver/data/math.h"

namespace sunder {

/// Twice the area over the longest edge squared: below this, rounding and tessellation decide the normal of a triangle.
inline constexpr double kSliver = 1e-4;

struct CornerWeights {
    Vec3f normal;  // unit; zero for slivers, which say nothing
    Vec3f angle;   // at the three corners, rad, within 1e-6
};

/// For each entry k of [begin, end): of triangle which[k] -> out[k]. Edges and products in double: small triangles far
/// from the origin keep their normals.
void weigh_corners(std::span<const Triangle> triangles, std::span<const uint32_t> which,
                   std::span<const Vec3> positions, size_t begin, size_t end, CornerWeights* out);

}  // namespace sunder
