// Flat outlines filled with triangles.
#pragma once

#include <span>
#include <vector>

#include "solver/data/math.h"

namespace sunder {

struct FilledOutline {
    std::vector<Triangle> triangles;  // counter-clockwise seen against the normal
    bool may_overlap = false;         // closed and of the right area, but some triangles lie over others
};

/// A constrained Delaunay triangulation of the inside of `loops` (vertices into `points`, each at most once),
/// counter-clockwise around the inside seen against `normal`. It has the loops' sides as its border and no vertices but
/// theirs, so whatever else ends in the loops fits to it. Loops that touch one another are filled one by one. Where
/// rounded points make sides cross, or the outline is not simple, ears are cut off a loop as well as may be. Same bits
/// for the same input; may be called from several threads.
FilledOutline fill_outline(std::span<const Vec3> points, std::span<const std::span<const uint32_t>> loops,
                           const Vec3& normal);

}  // namespace sunder
