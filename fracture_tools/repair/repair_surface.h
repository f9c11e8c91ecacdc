// Triangles joined into surfaces, crossings found, holes filled (CGAL's polygon mesh processing behind plain data).
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// Surfaces whose edges have two triangles of one orientation, or one: equal positions welded, triangles with fewer
/// than three corners and all but one of several in one place dropped, orientation made consistent. Where more than two
/// triangles meet in an edge, or several fans in a vertex, the surface is parted. Positions and triangles alone;
/// corners of a triangle may come in another order. Errors: nothing is left, what CGAL refuses (as a sentence).
Result<TriMesh> join_triangles(const MeshView& mesh, const std::string& where);

/// Pairs of triangles that cross, overlap or touch, beyond corners in the same place; triangles without area do not
/// count. `mesh` is as join_triangles() gives it. At most kMostCrossings: then there may be more.
constexpr size_t kMostCrossings = 1'000'000;
std::vector<std::array<uint32_t, 2>> crossing_triangles(const MeshView& mesh);

/// Triangles over a closed outline, as indices into it, that run round as it does. Empty if CGAL finds none.
std::vector<Triangle> fill_hole(std::span<const Vec3> outline);

}  // namespace sunder
