// Named values that an artist's mesh carries besides its first UV map and its first colours.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace sunder {

/// What has a row of a layer's values.
enum class LayerDomain : uint8_t { point, corner, face };

enum class LayerKind : uint8_t {
    number,   // 1 to 4 floats
    uv,       // 2 floats, by corner
    color,    // 4 floats, as Color
    weight,   // 1 float, by point: how much a vertex belongs to a group
    integer,  // 1 to 4 whole numbers
    boolean,  // the same, 0 or 1
};

/// Which layer it is: no mesh has two of the same name, domain and kind.
struct LayerId {
    std::string name;  // as the artist wrote it, UTF-8
    LayerDomain domain = LayerDomain::point;
    LayerKind kind = LayerKind::number;
    uint32_t width = 1;  // numbers a row, 1 .. kWidest

    static constexpr uint32_t kWidest = 4;

    bool operator==(const LayerId&) const = default;

    /// Within a triangle rows of its corners are blended; or it is all the nearest corner's.
    bool is_blended() const { return kind != LayerKind::integer && kind != LayerKind::boolean; }
    /// What break surfaces have, each number of it; UVs are those of the cut (FragmentSet::interface_corner_uvs).
    float inside() const { return kind == LayerKind::color ? 1.0f : 0.0f; }
};

/// `values`: row after row. A whole number stands there as its bits (std::bit_cast): it is copied, never computed with.
struct MeshLayer : LayerId {
    std::vector<float> values;

    MeshLayer() = default;
    MeshLayer(LayerId id, std::vector<float> v = {}) : LayerId(std::move(id)), values(std::move(v)) {}

    size_t n_rows() const { return values.size() / width; }
    const float* row(size_t i) const { return values.data() + i * width; }
};

}  // namespace sunder
