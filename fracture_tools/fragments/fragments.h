// Labelled cells become fragments: surfaces, interfaces, attributes of the mesh that was cut.
#pragma once

#include <span>

#include "fracture_tools/cells/cell_complex.h"
#include "solver/data/fragment_set.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// Sets `source_triangle` of every outer face to the triangle of `source` nearest to its middle; for complexes whose
/// surface was meshed anew.
void find_source_triangles(const TriMesh& source, CellComplex& io_complex);

/// Gathers the cells of each label (0 .. n_labels - 1) into a fragment. Outer faces need a source triangle, which gives
/// them their material. With source weights, UVs and normals are the source's own at each corner. Without, the surface
/// is a new one: where a corner lies beyond its triangle on the same chart the chart's UVs are used, and corner normals
/// are not carried over, since they belong to a surface that is no longer there. Measured (measure_fragments), with
/// interface UVs and the vertex groups of `source`.
FragmentSet make_fragments(const CellComplex& complex, std::span<const uint32_t> label, uint32_t n_labels,
                           const TriMesh& source);

}  // namespace sunder
