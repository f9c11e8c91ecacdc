// Layers as columns of the PLY files that we write.
#pragma once

#include <concepts>
#include <vector>

#include "fracture_tools/mesh/layer_property.h"
#include "nodes/files/byte_buffer.h"
#include "nodes/files/ply_file.h"

namespace sunder {

/// The layers of a mesh that vertices, or faces, have: their properties, bytes and rows. Numbers are 32 bits wide,
/// those of a row or of three corners a list where they are several.
template <std::derived_from<LayerId> Layer>
class LayerColumns {
public:
    LayerColumns(const std::vector<Layer>& layers, bool of_faces) {
        for (const Layer& layer : layers)
            if ((layer.domain != LayerDomain::point) == of_faces) layers_.push_back(&layer);
    }

    void add_properties(PlyElement& io_element) const {
        for (const Layer* layer : layers_) {
            PlyProperty property{layer_property(*layer), layer->is_blended() ? PlyType::float32 : PlyType::int32, {}};
            if (length(*layer) > 1) property.count_type = PlyType::uint8;
            io_element.properties.push_back(std::move(property));
        }
    }

    size_t row_bytes() const {
        size_t n = 0;
        for (const Layer* layer : layers_) n += sizeof(float) * length(*layer) + (length(*layer) > 1 ? 1 : 0);
        return n;
    }

    /// put(data, bytes) of what vertex or face `row` has.
    template <class Put>
    void write_row(size_t row, Put&& put) const {
        for (const Layer* layer : layers_) {
            const auto n = static_cast<uint8_t>(length(*layer));
            if (n > 1) put(&n, sizeof n);
            put(layer->values.data() + row * n, sizeof(float) * n);
        }
    }

private:
    static size_t length(const LayerId& layer) { return layer.width * (layer.domain == LayerDomain::corner ? 3 : 1); }

    std::vector<const Layer*> layers_;
};

}  // namespace sunder
