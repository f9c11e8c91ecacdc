// Names, numbers and places of the vertices of a cut surface.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "fracture_tools/voronoi/triangle_clipping.h"

namespace sunder {

/// Where an edge of the mesh goes from one cell to another.
struct EdgeVertex {
    uint32_t low, high;  // vertices of the mesh
    uint32_t i, j;       // sites, i < j
    double share;        // of the way from low to high
};

/// Where a triangle is crossed by the line equally far from three sites.
struct TriangleVertex {
    uint32_t triangle;
    std::array<uint32_t, 3> sites;  // ascending
    Vec3 weights;                   // of the triangle's corners, sum 1
    bool leaves;                    // the line leaves the solid here, in the direction of (s_1 - s_0) x (s_2 - s_0)
};

/// Vertices are numbered: those of the mesh, then those on its edges, then those in its triangles. Their names are
/// symbols, so both sides of an edge and all pieces around a vertex mean the same one.
struct SurfaceVertices {
    uint32_t n_mesh = 0;
    std::vector<EdgeVertex> on_edges;          // ascending by (low, high, i, j)
    std::vector<TriangleVertex> in_triangles;  // ascending by (triangle, sites)
    std::vector<uint32_t> corner;              // vertex of each entry of ClippedSurface::side
    bool is_whole = true;                      // each name came up as often as it does on a closed surface

    uint32_t size() const { return n_mesh + uint32_t(on_edges.size() + in_triangles.size()); }

    /// Weights of a triangle's corners at one of the vertices on it.
    Vec3 weights(const Triangle& triangle, uint32_t vertex) const;
    /// Of all vertices, for a mesh with these points.
    std::vector<Vec3> positions(MeshView mesh) const;
};

SurfaceVertices number_surface_vertices(MeshView mesh, std::span<const Vec3> sites, const ClippedSurface& surface,
                                        PredicateCount& io_count);

}  // namespace sunder
