// Plane outlines filled with triangles: polygons of files, surfaces between Voronoi cells.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "solver/data/math.h"

namespace sunder {

/// Leaves out the coordinate along which the normal is longest: what is collinear in space stays so to the last bit.
struct PlaneProjection {
    int u, v;

    explicit PlaneProjection(const Vec3& normal);
    std::array<double, 2> operator()(const Vec3& p) const { return {p[u], p[v]}; }
};

/// Fills closed loops with triangles (constrained Delaunay, exact predicates), as `project` shows them: what an odd
/// number of sides parts from infinity. Loops name vertices, which are indices into `points`; a vertex may be there
/// several times, as where a hole is bridged to the loop around it by an edge that runs there and back.
///
/// Gives triangles of corners, which are numbered loop after loop, counter-clockwise in the projection: each corner of
/// a triangle is the one between whose sides the triangle lies. Nothing where sides cross or have their inside on the
/// right, a vertex lies on a side or where another vertex does, or all are collinear.
std::optional<std::vector<Triangle>> triangulate_outline(std::span<const Vec3> points,
                                                         std::span<const std::span<const uint32_t>> loops,
                                                         const PlaneProjection& project);

/// A polygon of a file as triangles of its corners, each exactly once within it, or nothing where its outline is not
/// simple as its flattest side shows it: a fan from the first corner where it is strictly convex, from the other one
/// where it has four corners and one that is not, else constrained Delaunay. `vertex`: of each corner, with no two
/// equal ones side by side; holes may be bridged.
std::optional<std::vector<Triangle>> triangulate_polygon(std::span<const Vec3> points,
                                                         std::span<const uint32_t> vertex);

}  // namespace sunder
