// The triangles of a surface cut along the cells of a Voronoi diagram.
#pragma once

#include <span>
#include <vector>

#include "fracture_tools/voronoi/predicates.h"
#include "fracture_tools/voronoi/voronoi_diagram.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// The part of a triangle in one cell: convex, counter-clockwise as the triangle.
struct SurfacePolygon {
    uint32_t triangle, cell;
    uint32_t begin, end;  // its corners in ClippedSurface::side
};

struct ClippedSurface {
    std::vector<SurfacePolygon> polygons;  // ascending by triangle
    /// Line that the polygon follows from a corner to the next one. The corner itself is where the line before it and
    /// this one meet.
    std::vector<LineLabel> side;
    PredicateCount count;  // with zeros in it, polygons are missing
};

/// Cuts each triangle by all cells that it meets. `diagram` may have more sites than `sites`: those are ignored, their
/// cells must not meet the mesh. Same bits for any number of threads. Error: cancelled.
Result<ClippedSurface> clip_surface(MeshView mesh, std::span<const Vec3> sites, const VoronoiDiagram& diagram,
                                    int threads, const Progress& progress);

}  // namespace sunder
