// Labelled cells become fragments: surfaces, interfaces, attributes of the mesh that was cut.
#pragma once

#include <span>

#include "fracture_tools/cell_complex.h"
#include "solver/data/fragment_set.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// Sets `source_triangle` of every outer face to the triangle of `source` nearest to its middle; for complexes whose
/// surface was meshed anew.
void find_source_triangles(const TriMesh& source, CellComplex& io_complex);

/// Gathers the cells of each label (0 .. n_labels - 1) into a fragment. Outer faces need a source triangle, which gives
/// them material and UVs; where a corner lies beyond it on the same chart the chart's UVs are used. Measured
/// (measure_fragments), with interface UVs and the vertex groups of `source`. Corner normals are not carried over: they
/// belong to a surface that is no longer there.
FragmentSet make_fragments(const CellComplex& complex, std::span<const uint32_t> label, uint32_t n_labels,
                           const TriMesh& source);

}  // namespace sunder
