// The artist's normals, turned with the surface that they were given for.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fracture_tools/skin/skin_motion.h"
#include "fracture_tools/skin/split_topology.h"
#include "solver/data/math.h"

namespace sunder {

struct alignas(16) CornerNormal {
    Vec3f unit;
    float unsaid = 0;  // 1 where no triangle tells a normal
};

/// One for all corners of a fan that were given the same, turned by the blend at the vertex that the fan is an instance
/// of (cofactor of its linear part, which is what carries normals). What breaks changes neither their number nor their
/// order: vertices that split keep what they have, so that those of one chunk of vertices can be turned as soon as
/// these are in place, while their maps are at hand.
class ArtistNormals {
public:
    /// `corner`: unit, of the outer corners, in rest coordinates (3 n_outer x 3); or empty.
    ArtistNormals(const SplitTopology& topology, std::span<const Vec3f> corner);

    size_t size() const { return unit_.size(); }
    std::span<const uint32_t> of_corner() const { return of_corner_; }  // (3 n_outer)

    /// Turns those of a chunk's vertices that moved. `map`, `moved`: of these vertices. `out`: (size())
    void turn(const SplitTopology& topology, size_t chunk, std::span<const NormalMap> map,
              std::span<const uint8_t> moved, std::span<CornerNormal> out, std::span<uint8_t> out_moved) const;

private:
    std::vector<Vec3f> unit_;             // (n x 3)
    std::vector<uint32_t> fan_;           // (n), ascending
    std::vector<uint32_t> chunk_offset_;  // (n_chunks + 1)
    std::vector<uint32_t> of_corner_;
};

}  // namespace sunder
