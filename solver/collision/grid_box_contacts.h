// Contact points of a box on a mesh that is known by its distances.
#pragma once

#include "solver/collision/shape_distance.h"
#include "solver/data/signed_distance_grid.h"

namespace sunder {

struct SurfaceField;

/// See rigid_grid_contacts; `box` in the field's frame, and so is what is returned.
Manifold box_grid_contacts(const SignedDistanceGrid& grid, const Vec3& half_extents, const Pose& box, double within);
Manifold box_grid_contacts(const SurfaceField& surface, const Vec3& half_extents, const Pose& box, double within);

}  // namespace sunder
