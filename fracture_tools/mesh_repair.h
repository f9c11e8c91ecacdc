// Surfaces as they come made into surfaces that bound a solid; the artist's triangles stay.
#pragma once

#include <string>
#include <vector>

#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// Welds, drops degenerate and duplicate triangles, orients outward, closes small holes. Triangles that stay keep their
/// corner attributes and material; those that close a hole have the material and UVs of a neighbour. What was done, and
/// self-intersections that remain, are told in `io_warnings`; a mesh in order passes through as it is.
///
/// Errors: a hole whose border is longer than half the diagonal of the bounding box (a sheet, not a solid), faults
/// that are left afterwards, non-finite coordinates, no volume.
Result<TriMesh> repair_mesh(const TriMesh& mesh, const std::string& where, std::vector<std::string>& io_warnings);

}  // namespace sunder
