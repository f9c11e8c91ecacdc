// Contact points of a box on a mesh that is known by its distance grid.
#pragma once

#include "solver/collision/shape_distance.h"
#include "solver/data/signed_distance_grid.h"

namespace sunder {

/// See rigid_grid_contacts; `box` in the grid's frame, and so is what is returned.
Manifold box_grid_contacts(const SignedDistanceGrid& grid, const Vec3& half_extents, const Pose& box, double within);

}  // namespace sunder
