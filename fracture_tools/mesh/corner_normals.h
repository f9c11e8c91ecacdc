// Normals for meshes that come without.
#pragma once

#include <vector>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// Unit normals of the corners of a closed mesh, (3 n_triangles x 3): the mean of the triangles around a vertex,
/// weighted by their angles there, as far as they hang together by edges flatter than `smooth_angle`, degrees. That is
/// how the visual mesh shades a surface that nobody gave normals to, hence a cut that hides it in a finer one has to
/// carry them.
std::vector<Vec3f> smooth_corner_normals(MeshView mesh, double smooth_angle = 60);

}  // namespace sunder
