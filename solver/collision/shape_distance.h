// Distances and contact points between ellipsoids, colliders and rigid bodies.
#pragma once

#include <array>

#include "solver/collision/ellipsoid_distance.h"
#include "solver/scene/scene.h"

namespace sunder {

/// A shape where it stands.
struct PlacedShape {
    Shape shape;
    Pose pose;
};

/// The points where two rigid solids may touch; at most eight, in a fixed order of features.
struct Manifold {
    std::array<Separation, 8> points;
    int count = 0;

    void add(const Separation& s) {
        if (count < int(points.size())) points[count++] = s;
    }
    double least_gap() const;  // infinite when empty, m
};

/// Radius of the sphere around the pose's position that holds the shape, m; infinite for a plane.
double bounding_radius(const Shape& shape);

/// World box of a placed shape; infinite for a plane.
Aabb bounding_box(const PlacedShape& placed);

/// Gap of an ellipsoid and a shape along their best separating direction (exact for a plane); minus the least
/// translation that parts them if they overlap. As safe as ellipsoid_distance. Needs radii and extents > 0.
Separation ellipsoid_shape_distance(const Ellipsoid& a, const PlacedShape& b);

/// A point against a shape: negative inside, normal towards the nearest surface.
Separation point_shape_distance(const Vec3& point, const PlacedShape& shape);

/// Contact points of a rigid sphere or box `a` against any shape `b`. Separated or shallow: the nearest features
/// (a face on a face gives its corners); deep: those along the shortest way out.
Manifold rigid_contacts(const PlacedShape& a, const PlacedShape& b);

}  // namespace sunder
