// Triangles that meet where they should not.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "solver/data/math.h"

namespace sunder {

/// Pairs of `triangles` that have more in common than the vertices that they share by index, ascending. Decided with
/// exact predicates. Triangles without area are left out. May be called from several threads.
std::vector<std::pair<uint32_t, uint32_t>> self_intersections(std::span<const Vec3> points,
                                                              std::span<const Triangle> triangles);

}  // namespace sunder
