// UVs, colours and layers of a mesh at points of another surface near it.
#pragma once

#include <optional>

#include "fracture_tools/mesh/surface_lookup.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// Looks up on `source`, which must outlive it, what corners of a new surface have.
class SourceCorners {
public:
    explicit SourceCorners(const TriMesh& source) : source_(source), lookup_(source) {}

    /// Of a corner at `p` of a face with centroid `middle`, which belongs to source triangle `home`.
    struct Place {
        uint32_t home = 0;
        SurfacePoint near;                         // from the corner a little into its own face
        std::optional<Vec3> at_corner, at_middle;  // weights of the corners of `home`, which may be beyond it; none of
                                                   // a triangle without area
        Vec3 held = Vec3::UnitX();                 // the same of the point of `home` that is nearest to `p`
    };
    Place place(const Vec3& p, const Vec3& middle, uint32_t home) const;

    /// The nearest point's UVs, unless they lie beyond a seam: then those that `home` would have if it went on.
    Vec2f uvs(const Place& place) const;
    /// Of a layer by corner. UVs as above. Others beyond a seam have what `home` has nearest to the corner: colours and
    /// weights that went on would leave their range.
    void append(const Place& place, const MeshLayer& layer, std::vector<float>& io_values) const;
    /// All layers by corner of the source; `io_layers` has them in the same order.
    void append_all(const Place& place, std::vector<MeshLayer>& io_layers) const {
        for (size_t k = 0; k < source_.layers.size(); ++k)
            if (source_.layers[k].domain == LayerDomain::corner) append(place, source_.layers[k], io_layers[k].values);
    }

private:
    bool is_beyond_seam(const Place& place, const float* corners, size_t n, float* out_exact,
                        float* out_extended) const;

    const TriMesh& source_;
    SurfaceLookup lookup_;
};

}  // namespace sunder
