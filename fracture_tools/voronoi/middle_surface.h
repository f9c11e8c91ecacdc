// Where a solid is a sheet, and the surface in the middle between its faces.
#pragma once

#include <optional>

#include "fracture_tools/mesh/surface_lookup.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// Looks at the balls that touch a solid's surface from within at two places (Ma, Bae, Choi 2012, shrinking balls).
/// Where these lie opposite each other the solid is a sheet as thick as the ball.
class MiddleSurface {
public:
    struct Place {
        Vec3 position;     // the ball's centre, m
        double thickness;  // its diameter, m
    };

    /// The solid must outlive it.
    explicit MiddleSurface(MeshView solid);

    /// Of the ball that touches where the surface is nearest to p, which may lie a little outside; by a rim, of one
    /// farther in, as far to the side as p is. None: the solid is not thinner than `most` there, or its faces do not
    /// look away from each other.
    std::optional<Place> at(const Vec3& p, double most) const;

private:
    std::optional<Place> between_faces(const Vec3& p, double most) const;
    Vec3 normal(uint32_t triangle) const;  // unit, outward; 0 of a degenerate one

    MeshView solid_;
    SurfaceLookup surface_;
    double diagonal_ = 0;  // m
};

}  // namespace sunder
