// Does a mesh have edges that a new surface must keep?
#pragma once

#include "solver/data/tri_mesh.h"

namespace sunder {

/// Angle in degrees above which edges of `mesh` should stay edges when its surface is meshed anew with cells of
/// `cell_size` (m), or 0 for none: features cost cells, and on organic shapes they gain nothing. They are kept
///  - at 40 degrees, where sharp edges stand alone (machined parts: little length lies between 15 and 40 degrees);
///  - at 15 degrees, where edges are long against the cells (few large triangles: each edge is meant).
double choose_sharp_angle(const MeshView& mesh, double cell_size);

}  // namespace sunder
