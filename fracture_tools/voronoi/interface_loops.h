// The outlines of the surfaces between Voronoi cells within a solid.
#pragma once

#include <vector>

#include "fracture_tools/voronoi/inside_sections.h"

namespace sunder {

/// The part of a Voronoi face within the solid: counter-clockwise loops around it and clockwise ones around its holes,
/// seen against the normal from cell a to cell b. It may have several parts.
struct InterfaceOutline {
    uint32_t a, b;                  // cells, a < b
    uint32_t loop_begin, loop_end;  // in InterfaceOutlines::loop_offset
};

struct InterfaceOutlines {
    std::vector<InterfaceOutline> interfaces;  // ascending by (a, b)
    std::vector<uint32_t> loop_offset;         // loop k has the vertices from loop_offset[k] to loop_offset[k + 1]
    std::vector<uint32_t> vertex;
    size_t broken = 0;  // vertices where an outline does not go on; 0 on a closed surface
};

/// Chains the sides of surface polygons along a bisector and the sections of Voronoi edges by the names of their ends.
InterfaceOutlines chain_interface_loops(const VoronoiDiagram& diagram, const ClippedSurface& surface,
                                        const SurfaceVertices& vertices, const InsideSkeleton& skeleton);

}  // namespace sunder
