// Solids that overlap become one.
#pragma once

#include <array>
#include <span>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// Unites the shells of a mesh that cross one another (CGAL's corefinement, in exact numbers, rounded once at the end).
/// Triangles that no other shell cuts stay as they are; what is left of the others has their corner attributes at its
/// corners; what lies within another solid is gone. `crossing`: pairs of triangles that cross. Shells are oriented to
/// bound a solid (arrange_shells).
///
/// The number of shells united; 0, and the mesh as it was: none cross, one that crosses another also crosses itself or
/// is a cavity, more than kMostUnionCrossings, or CGAL refuses.
constexpr size_t kMostUnionCrossings = 50'000;
size_t unite_shells(TriMesh& io_mesh, std::span<const std::array<uint32_t, 2>> crossing);

}  // namespace sunder
