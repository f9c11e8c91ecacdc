// What triangles say about the normals at their corners: unit normals and angles, many at a time.
#pragma once

#include <cstdint>
#include <span>

#include "solver/data/math.h"

namespace sunder {

/// Twice the area over the longest edge squared: below this, rounding and tessellation decide the normal of a triangle.
inline constexpr double kSliver = 1e-4;

struct alignas(32) CornerWeights {
    Vec3f normal = Vec3f::Zero();  // unit; zero for slivers, which say nothing
    float fill_1 = 0;              // each row is read as four numbers
    Vec3f angle = Vec3f::Zero();   // at the three corners, rad, within 1e-6
    float fill_2 = 0;
};

/// For each triangle t of [begin, end): out[face[t] - first_face], zero where `silent` (by face) says so. Edges and
/// products in double: small triangles far from the origin keep their normals.
void weigh_corners(std::span<const Triangle> triangles, std::span<const uint32_t> face, std::span<const uint8_t> silent,
                   std::span<const Vec3> positions, size_t begin, size_t end, uint32_t first_face, CornerWeights* out);

}  // namespace sunder
