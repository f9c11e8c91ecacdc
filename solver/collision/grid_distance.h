// Distances and contact points of ellipsoids, spheres and boxes against a mesh that is known by its distances: those of
// a grid, or of a surface on its way (surface_distance.h). A Field is a SignedDistanceGrid or a SurfaceField.
#pragma once

#include "solver/collision/shape_distance.h"
#include "solver/data/signed_distance_grid.h"

namespace sunder {

struct GridSample {
    double distance = 0;            // m, negative inside
    Vec3 gradient = Vec3::UnitZ();  // of `distance`; about unit length, null where the surface is equally far all round
};

/// Trilinear between the nodes; beyond them a lower bound of the distance that continues it: the nearest point of the
/// grid's box splits the way to any point of the surface at an obtuse angle. `x` in the grid's frame, m.
GridSample sample(const SignedDistanceGrid& grid, const Vec3& x);

/// A point against a mesh: negative inside, normal towards the nearest surface.
template <class Field>
Separation point_grid_distance(const Vec3& point, const Field& field, const Pose& pose);

/// Where an ellipsoid lies on or in a mesh, at most four points, the deepest first; at least one. They are the minima
/// of the distance over the ellipsoid's surface (one on a plane, two in a groove), found by descent from fixed
/// directions, so that minima nearer together than those may be missed. With its centre inside the mesh, or a thin wall
/// through it: the one point that leads back out to the side of its centre.
template <class Field>
Manifold ellipsoid_grid_contacts(const Ellipsoid& a, const Field& field, const Pose& pose);

/// Where a rigid sphere or box lies on or in a mesh: points whose gap is below `within` (m), the deepest first; may be
/// empty. Of a box: its corners, and where a face or an edge of it is nearer to the mesh than its corners tell.
template <class Field>
Manifold rigid_grid_contacts(const PlacedShape& a, const Field& field, const Pose& pose, double within);

}  // namespace sunder
