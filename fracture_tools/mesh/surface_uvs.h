// UVs and colours of a mesh at points of another surface near it.
#pragma once

#include "fracture_tools/mesh/surface_lookup.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// Colour of a point of a triangle, by the weights of its corners. In doubles, so that weights which sum to 1 leave a
/// triangle of one colour its colour.
Color blended_color(const TriMesh& mesh, uint32_t triangle, const Vec3& weights);

/// Looks UVs up on `source`, which has some and must outlive it.
class SourceUvs {
public:
    explicit SourceUvs(const TriMesh& source) : source_(source), lookup_(source) {}

    /// Of a corner at `p` of a face with centroid `middle`, which belongs to source triangle `home`. The nearest
    /// point's UVs, unless they lie beyond a seam: then those that `home` would have if it went on.
    Vec2f at(const Vec3& p, const Vec3& middle, uint32_t home) const;

private:
    Vec2f blend(uint32_t t, const Vec3& weights) const;
    Vec2f in_plane_of(uint32_t t, const Vec3& p) const;

    const TriMesh& source_;
    SurfaceLookup lookup_;
};

}  // namespace sunder
