// Triangles welded by position; walls and fins within and upon solids taken away.
#pragma once

#include "solver/data/tri_mesh.h"

namespace sunder {

/// Equal positions become one vertex; triangles with a vertex twice go, and all but the first of several with the same
/// vertices. The number of triangles dropped.
size_t weld_positions(TriMesh& io_mesh);

/// For surfaces with edges that have more than two triangles: keeps those that part solid from empty space, and what
/// bounds whatever hangs together. Space is
/// divided into cells by going round each edge from triangle to triangle in the order of their angles (Zhou et al. 2016
/// do so exactly); a bounded cell is solid unless most of its surface faces into it. Triangles with solid on both sides
/// (walls), or with the same cell on both sides (fins), go. The number of triangles dropped; none are where a hole
/// joins inside and outside, so that nothing would be left.
size_t drop_walls(TriMesh& io_mesh);

}  // namespace sunder
