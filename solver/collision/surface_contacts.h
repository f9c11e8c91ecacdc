// When a solid touches a mesh that deforms on its way, and all that it may touch.
#pragma once

#include <vector>

#include "solver/collision/detection.h"

namespace sunder {

/// A collider with a surface as it is at the end of the step, where it begins: what its whole does is left out.
PlacedShape at_end(const MovingShape& mesh);

/// Contacts of an ellipsoid, or a rigid sphere or box, that moves by `shift` as seen from the mesh's whole: points that
/// come within `reach` (> 0, m), with normals of the moment of touch, as they are before the move: of the mesh the
/// point of its surface that is touched, where that begins.
///
/// Solid and surface are advanced together by no more than the distance between them over the speed of both, which is
/// that of those triangles alone that the solid may meet on its way; so no wall passes, however thin or fast. After the
/// first touch the rest of the way is followed along with the surface that was touched, as grid_contacts does.
void surface_contacts(const Ellipsoid& a, const MovingShape& mesh, const Vec3& shift, double reach,
                      std::vector<Separation>& out);
void surface_contacts(const PlacedShape& a, const MovingShape& mesh, const Vec3& shift, double reach,
                      std::vector<Separation>& out);

/// Of such a collider over the step, where it touches at `point` (m, in the scene): its whole, and what its surface
/// does within that at the point nearest to it, m.
Vec3 surface_motion(const MovingShape& mesh, const Vec3& point);

}  // namespace sunder
