// Sheets become solids.
#pragma once

#include <span>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// Gives marked shells (all triangles of a shell are) a thickness in m: their triangles stay as the outer side, a copy
/// of them `thickness` below is the inner side, and quads along the borders are the rim. Both sides have the sheet's
/// UVs, the rim those of its border. In a vertex where triangles lean against one another the copy lies deeper, up to
/// twice, so that walls are as thick as asked for. Where the sheet bends more tightly than it is thick, the inner side
/// crosses itself.
void thicken(TriMesh& io_mesh, std::span<const uint8_t> marked, double thickness);

}  // namespace sunder
