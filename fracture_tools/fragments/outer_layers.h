// Layers of a cut mesh: rows of the outer surface, and what break surfaces have in their place.
#pragma once

#include <algorithm>
#include <array>

#include "solver/data/fragment_set.h"

namespace sunder {

using LayerRow = std::array<float, LayerId::kWidest>;

inline LayerRow row_of(const MeshLayer& layer, size_t row) {
    LayerRow values{};
    std::copy_n(layer.row(row), layer.width, values.begin());
    return values;
}

/// `corner`: entry of interface_corner_uvs.
inline LayerRow row_inside(const FragmentSet& set, const LayerId& layer, size_t corner) {
    LayerRow values;
    values.fill(layer.inside());
    if (layer.kind == LayerKind::uv && !set.interface_corner_uvs.empty())
        std::copy_n(set.interface_corner_uvs[corner].data(), 2, values.begin());
    return values;
}

}  // namespace sunder
