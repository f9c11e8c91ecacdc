// Where k-means begins.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fracture_tools/mesh/point_grid.h"

namespace sunder {

/// k-means++ (Arthur & Vassilvitskii 2007): `n` of the points, each next one drawn with probability weight * (distance
/// to the nearest one so far)^2 (n x 3), m. Points that coincide, or have no weight, come last, in their order. Needs
/// n <= points; `weights` go by the indices of the grid's points.
std::vector<Vec3> seed_centers(const PointGrid& points, std::span<const double> weights, uint32_t n, uint64_t seed);

}  // namespace sunder
