// Borders of open surfaces: found, measured, welded, closed.
#pragma once

#include <vector>

#include "solver/data/progress.h"
#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// An edge that has a triangle on one side only, as that triangle runs along it.
struct OpenEdge {
    uint32_t from, to;
    uint32_t corner;  // at `from` (3 * triangle + corner)
};

/// Ascending by their ends.
std::vector<OpenEdge> find_open_edges(const MeshView& mesh);

/// One loop of open edges.
struct Border {
    std::vector<uint32_t> vertices;  // in the order in which triangles that close it have them
    double length = 0;               // m
};

/// Borders of a surface as join_triangles() gives it, ascending by their lowest vertex.
std::vector<Border> find_borders(const MeshView& mesh);

/// Gives vertices of borders that lie within `tolerance` (m) of one another one position. The number of vertices moved.
size_t weld_borders(TriMesh& io_mesh, const std::vector<Border>& borders, double tolerance);

/// Closes borders with triangles that have a neighbour's material and UVs; around a point in the middle where no others
/// do. Errors: cancelled.
Status close_borders(TriMesh& io_mesh, const std::vector<Border>& borders, const Progress& progress);

}  // namespace sunder
