// Shapes of rigid bodies and colliders as meshes, for those who look at them.
#pragma once

#include "solver/data/tri_mesh.h"
#include "solver/scene/scene.h"

namespace sunder {

/// Closed surface of a sphere, box or capsule in its own frame, with normals; of a plane a square of side `extent` at
/// z = 0. Round surfaces lie within 1.5 % of a radius inside of the shape. Empty for shape mesh.
TriMesh shape_mesh(const Shape& shape, double extent);

}  // namespace sunder
