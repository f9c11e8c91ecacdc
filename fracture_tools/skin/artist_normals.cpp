#include "fracture_tools/skin/artist_normals.h"

#include <algorithm>

#include "fracture_tools/mesh/counting_sort.h"
#include "fracture_tools/skin/four_floats.h"
#include "fracture_tools/skin/vector_clones.h"

namespace sunder {
namespace {

// `vertex`: of fans; `first_vertex`: the one that `map` and `moved` begin with.
SUNDER_VECTOR_CLONES void turn_normals(const Vec3f* unit, const uint32_t* fan, size_t n, const uint32_t* vertex,
                                       uint32_t first_vertex, const NormalMap* map, const uint8_t* moved,
                                       CornerNormal* out, uint8_t* out_moved) {
    for (size_t i = 0; i < n; ++i) {
        const uint32_t v = vertex[fan[i]] - first_vertex;
        out_moved[i] = moved[v];
        if (!moved[v]) continue;
        const FourFloats* column = reinterpret_cast<const FourFloats*>(map[v].column);
        const FourFloats image = column[0] * unit[i].x() + column[1] * unit[i].y() + column[2] * unit[i].z();
        const FourFloats length = length_of(image);
        reinterpret_cast<FourFloats&>(out[i]) =
            length[0] > kShortestNormal ? image / length : FourFloats{unit[i].x(), unit[i].y(), unit[i].z(), 0};
    }
}

}  // namespace

ArtistNormals::ArtistNormals(const SplitTopology& topology, std::span<const Vec3f> corner)
    : chunk_offset_(topology.n_chunks() + 1, 0), of_corner_(corner.size()) {
    const Groups of_fan = group_by(static_cast<uint32_t>(corner.size()), static_cast<uint32_t>(topology.n_fans()),
                                   [&](uint32_t c) { return topology.corner_fan(c); });
    for (size_t chunk = 0; chunk < topology.n_chunks(); ++chunk) {
        for (uint32_t fan = topology.chunk_fan(chunk); fan < topology.chunk_fan(chunk + 1); ++fan) {
            const auto first = static_cast<std::ptrdiff_t>(unit_.size());
            for (const uint32_t c : of_fan[fan]) {
                const auto known = std::find(unit_.begin() + first, unit_.end(), corner[c]);
                of_corner_[c] = static_cast<uint32_t>(known - unit_.begin());
                if (known == unit_.end()) unit_.push_back(corner[c]), fan_.push_back(fan);
            }
        }
        chunk_offset_[chunk + 1] = static_cast<uint32_t>(unit_.size());
    }
}

void ArtistNormals::turn(const SplitTopology& topology, size_t chunk, std::span<const NormalMap> map,
                         std::span<const uint8_t> moved, std::span<CornerNormal> out,
                         std::span<uint8_t> out_moved) const {
    const uint32_t begin = chunk_offset_[chunk], n = chunk_offset_[chunk + 1] - begin;
    turn_normals(unit_.data() + begin, fan_.data() + begin, n, topology.vertices_of_fans().data(),
                 topology.chunk_vertex(chunk), map.data(), moved.data(), out.data() + begin, out_moved.data() + begin);
}

}  // namespace sunder
