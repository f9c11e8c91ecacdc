// A solid cut along the Voronoi cells of sites.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fracture_tools/cells/cell_complex.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// Sites are moved at random by up to this share of the mesh's diagonal: in general position every vertex of the cut
/// has one name. On an exact grid none has.
constexpr double kSiteJitter = 1e-6;

/// Parts of cells on the artist's own surface: the complex has source weights and sites. A cell is in one piece; the
/// same site may have several. Tells in `io_warnings` where interfaces could not be filled properly.
///
/// `solid` must bound a solid. Deterministic for one `seed`, with any number of threads (0: all cores). Errors: a
/// surface that crosses itself so that inside and outside are not determined, cancelled.
Result<CellComplex> cut_by_sites(const TriMesh& solid, std::span<const Vec3> sites, uint64_t seed, int threads,
                                 const std::string& where, std::vector<std::string>& io_warnings,
                                 const Progress& progress = {});

}  // namespace sunder
