// The cells of a Voronoi diagram within a solid: the restricted Voronoi diagram (Yan et al. 2009), exact in its
// topology.
//
//   clip_surface            each triangle of the mesh by the cells it meets, all vertices being symbols
//   find_inside_sections    what of the Voronoi edges is inside, by counting crossings from infinity
//   chain_interface_loops   the outlines of what parts two cells, by the names of their vertices
//   fill_outline            one triangulation for both sides
//
// Around a Voronoi edge there are exactly three cells, around a vertex four: any union of cells has a manifold surface.
#pragma once

#include <span>
#include <string>

#include "fracture_tools/cells/cell_complex.h"
#include "fracture_tools/voronoi/predicates.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

struct RestrictedVoronoi {
    /// One cell a site, as one or more closed surfaces; cells are not measured yet (split_into_parts does). Outer faces
    /// come first, ascending by source triangle, and have their weights.
    CellComplex complex;
    PredicateCount predicates;
    size_t mismatches = 0;   // contradictions about what is inside: the surface is not closed, or crosses itself
    size_t overlaps = 0;     // Voronoi vertices in several solids at once
    size_t overlapping = 0;  // interfaces that could only be filled with triangles that lie over one another

    /// No symbol has two meanings. Else sites must be moved a little, and the complex is empty.
    bool is_generic() const { return predicates.zeros == 0; }
};

/// `mesh` must bound a solid. `sites`: any number from 1 on, in or out of the solid, m. Same bits for any number of
/// threads (0: all cores). Errors: cancelled, two sites in one place.
Result<RestrictedVoronoi> restrict_voronoi(const TriMesh& mesh, std::span<const Vec3> sites, int threads,
                                           const Progress& progress = {});

}  // namespace sunder
