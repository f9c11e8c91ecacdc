// Seams whose two sides do not meet: how far apart they are, and vertices of one side on edges of the other.
#pragma once

#include <span>
#include <vector>

#include "fracture_tools/repair/repair_holes.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// How far apart open edges are that run side by side, m: opposite ways, with both ends nearer to others than a tenth
/// of both lengths, their triangles not folded onto one another. The largest such distance from `least` to `largest`,
/// but for those beyond a leap: a hole among seams is none of them. 0: no two run side by side.
double seam_gap(const MeshView& mesh, std::span<const OpenEdge> open, double least, double largest);

/// Splits open edges at the vertices of borders that lie on them, within `tolerance` (m), and their triangles with
/// them; no vertex moves. Corners there have what the triangle has in the place.
struct SplitEdges {
    size_t n = 0;                  // edges
    Vec3 first = Vec3::Zero();     // a vertex that lay on one, m
    std::vector<uint32_t> source;  // of each triangle beyond those there were
};
SplitEdges split_open_edges(TriMesh& io_mesh, std::span<const OpenEdge> open, double tolerance);

}  // namespace sunder
