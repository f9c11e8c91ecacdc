// When a solid that moves straight past a mesh touches it first, and all that it may touch on its way.
#pragma once

#include <vector>

#include "solver/collision/shape_distance.h"

namespace sunder {

/// Contacts of an ellipsoid, or a rigid sphere or box, with a placed mesh that stands still while the solid moves by
/// `shift`: points that come within `reach` (> 0, m), as they are before the move (normals of the moment of touch).
///
/// The distance changes by no more than the way, so that the solid may be advanced by it until it touches; a mesh wall
/// that the grid knows at all is not passed. After the first touch the rest of the way is followed along the surface
/// that was touched, in steps of half the solid's least radius, eight at most: what stands in a corner is found too.
void grid_contacts(const Ellipsoid& a, const PlacedShape& mesh, const Vec3& shift, double reach,
                   std::vector<Separation>& out);
void grid_contacts(const PlacedShape& a, const PlacedShape& mesh, const Vec3& shift, double reach,
                   std::vector<Separation>& out);

}  // namespace sunder
