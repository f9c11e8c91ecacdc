// Solids that overlap become one.
#pragma once

#include <array>
#include <span>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// Shells that cross one another, each group of them judged by itself.
struct UnionReport {
    size_t united = 0, left = 0;     // shells; those left overlap as before
    Vec3 first_left = Vec3::Zero();  // m
};

/// Unites the shells of a mesh that cross one another (CGAL's corefinement, in exact numbers, rounded once at the end):
/// a group's solids, each without the cavities in it that something crosses. Triangles that no other shell cuts stay as
/// they are; what is left of the others has their corner attributes at its corners; what lies within another solid is
/// gone. Solids that only touch along an edge or in a point stay apart. `crossing`: pairs of triangles that cross.
/// Shells are oriented to bound a solid (arrange_shells).
///
/// A group is left as it was when it has more than kMostUnionCrossings, one of its shells crosses itself near another,
/// or CGAL refuses.
constexpr size_t kMostUnionCrossings = 50'000;
UnionReport unite_shells(TriMesh& io_mesh, std::span<const std::array<uint32_t, 2>> crossing);

}  // namespace sunder
