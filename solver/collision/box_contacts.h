// Contact points of rigid boxes: on boxes and on capsules.
#pragma once

#include "solver/collision/shape_distance.h"

namespace sunder {

/// Two boxes. Apart: exact nearest features; overlapping: the shortest of the 15 separating axes (Gottschalk et al.
/// 1996). A face as nearest feature gives the other box's face clipped to it (at most 8 points), an edge or a corner
/// one point. Faces are preferred to edges, and those of a to those of b, unless clearly deeper: resting boxes keep
/// their points from step to step.
Manifold box_box_contacts(const PlacedShape& a, const PlacedShape& b);

/// A box and a capsule: one point, or two where the capsule lies along a face.
Manifold box_capsule_contacts(const PlacedShape& a, const PlacedShape& b);

}  // namespace sunder
