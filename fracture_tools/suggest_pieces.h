// How many pieces a solid needs, so that it deforms as the continuum does.
#pragma once

#include "solver/data/tri_mesh.h"

namespace sunder {

/// How thick a solid is where it is thin: the lesser of its least extent along its principal axes and of
/// 4 volume / area (the side of a long square rod; of a ball two thirds of its diameter, of a shell twice its
/// thickness), m. `solid` is closed and has a volume above 0.
double thinnest_extent(const TriMesh& solid);

/// Pieces of like size with which elastic displacements come within `error` (above 0; 0.02: 2 %) of the continuum's
/// in the mean (L2), 1 .. 100000. With n pieces across a bar that is stretched, twisted or bent they are off by about
/// 0.1 n^-0.78 where the pieces are cubes and by a quarter more where they are Voronoi cells (docs/measurements.md); n
/// is counted across the thinnest extent.
int suggest_pieces(const TriMesh& solid, double error);

}  // namespace sunder
