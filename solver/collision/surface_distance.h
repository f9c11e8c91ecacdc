// Distances to a surface whose vertices are on their way: by its triangles, for it is another one at every moment.
#pragma once

#include <optional>

#include "solver/collision/grid_distance.h"
#include "solver/data/moving_surface.h"

namespace sunder {

/// The surface of a shape where it stands at a moment; in the frame of its whole, m. It remembers where it was asked
/// last, for the next place is most often near: made for one thing, and asked in one order, it gives the same bits.
struct SurfaceField {
    const MovingSurface* surface;
    double share;               // of the frame
    Aabb bounds;                // of what is solid
    double voxel_size;          // a hundredth of its longest side: what is small on it
    mutable uint32_t near = 0;  // triangle

    /// Of a shape that has a surface.
    explicit SurfaceField(const Shape& shape);
    /// The same at another moment.
    SurfaceField at(double other_share) const;
};

/// The point of a surface that is nearest to another.
struct NearestPoint {
    uint32_t triangle = 0;
    Vec3 weight = Vec3::Zero();  // of its corners
    Vec3 point = Vec3::Zero();   // m
    double squared = 0;          // distance, m2
};
NearestPoint nearest(const SurfaceField& field, const Vec3& x);

/// Signed by the mean of the normals at the nearest point, by the angles that triangles have there (Baerentzen and
/// Aanaes 2005), which is right wherever the surface is closed. `x` in the field's frame, m.
GridSample sample(const SurfaceField& field, const Vec3& x);

/// How far the fastest vertex of those triangles goes, from the field's moment to another, that come into a box
/// (field's frame, m) on that way; nothing where none does.
std::optional<double> fastest_in(const SurfaceField& field, double end_share, const Aabb& box);

/// The way of the surface at its point nearest to `x`, within the whole, over all of the frame, m.
Vec3 way_at(const SurfaceField& field, const Vec3& x);

}  // namespace sunder
