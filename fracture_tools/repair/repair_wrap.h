// A new closed surface around any triangles (CGAL's alpha wrap behind plain data).
#pragma once

#include <string>

#include "solver/data/progress.h"
#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// Wraps the triangles, whatever their faults, in one or more closed 2-manifold surfaces that do not cross themselves
/// (Portaneri et al. 2022): gaps and hollows narrower than `detail` (m) are bridged, cavities filled. The surface is
/// drawn back onto the triangles as far as it does not cross itself then. Positions and triangles alone. Ends after
/// kMostWrapPoints points. Errors: that, what CGAL refuses (as a sentence), cancelled.
constexpr size_t kMostWrapPoints = 2'000'000;
Result<TriMesh> wrap_surface(const MeshView& mesh, double detail, const std::string& where, const Progress& progress);

}  // namespace sunder
