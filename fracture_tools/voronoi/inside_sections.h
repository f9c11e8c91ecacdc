// Which parts of the Voronoi edges lie in the solid.
#pragma once

#include <span>
#include <vector>

#include "fracture_tools/voronoi/surface_vertices.h"
#include "fracture_tools/voronoi/voronoi_diagram.h"

namespace sunder {

/// A piece of a Voronoi edge within the solid, in the direction of (s_1 - s_0) x (s_2 - s_0).
struct InsideSection {
    uint32_t edge;      // of the diagram
    uint32_t from, to;  // surface vertices, or SurfaceVertices::size() + entry of InsideSkeleton::vertices
};

struct InsideSkeleton {
    std::vector<InsideSection> sections;  // ascending by edge
    std::vector<uint32_t> vertices;       // Voronoi vertices in the solid, ascending
    size_t mismatches = 0;                // ways to one Voronoi vertex that cross the surface differently often
    size_t overlaps = 0;                  // Voronoi vertices that the solid covers other than once
};

/// Goes along the Voronoi edges from infinity, which is outside, and counts crossings of the surface; no ray is cast.
/// On a closed surface that does not cross itself, mismatches and overlaps are 0.
InsideSkeleton find_inside_sections(MeshView mesh, std::span<const Vec3> sites, const VoronoiDiagram& diagram,
                                    const SurfaceVertices& surface, PredicateCount& io_count);

}  // namespace sunder
