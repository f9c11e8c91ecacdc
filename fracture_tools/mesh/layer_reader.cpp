#include "fracture_tools/mesh/layer_reader.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "fracture_tools/mesh/layer_property.h"

namespace sunder {
namespace {

/// As layers hold it; what is no finite number, or no integer where it should be one, is 0.
float stored(const LayerId& layer, double value) {
    if (!std::isfinite(value)) return 0;
    if (layer.kind == LayerKind::boolean) return std::bit_cast<float>(int32_t{value != 0});
    if (layer.kind == LayerKind::integer) {
        constexpr double kEnd = 0x1p63;  // of what a 64-bit number holds
        return std::bit_cast<float>(std::abs(value) < kEnd ? static_cast<int32_t>(static_cast<int64_t>(value)) : 0);
    }
    const float number = static_cast<float>(value);
    return std::isfinite(number) ? number : 0;
}

}  // namespace

bool LayerReader::add(std::string_view property, size_t place, bool is_face, bool is_integer) {
    const std::optional<LayerId> id = layer_of_property(property, is_face, is_integer);
    if (!id || std::ranges::any_of(columns_, [&](const Column& c) { return c.layer == *id; })) return false;
    columns_.push_back({MeshLayer(*id), place});
    has_face_layers_ |= is_face;
    return true;
}

Status LayerReader::append(Column& io_column, const Item& item, size_t n_rows, const std::string& where,
                           const char* kind, uint64_t index) const {
    const std::vector<double>& values = item[io_column.place];
    MeshLayer& layer = io_column.layer;
    if (!io_column.is_begun && n_rows > 0 && values.size() % n_rows == 0 &&
        is_layer_width(layer, values.size() / n_rows)) {
        layer.width = static_cast<uint32_t>(values.size() / n_rows);
        io_column.is_begun = true;
    }
    if (!io_column.is_begun || values.size() != n_rows * layer.width)
        return bad_input(where, std::string(kind) + " " + std::to_string(index) + " has " +
                                    std::to_string(values.size()) + " numbers of '" + layer_property(layer) +
                                    "', which is not what a row of it holds");
    for (const double value : values) layer.values.push_back(stored(layer, value));
    return {};
}

Status LayerReader::add_vertex(const Item& item, uint32_t vertex, const std::string& where, uint64_t index) {
    for (Column& c : columns_) {
        if (c.layer.domain != LayerDomain::point || c.layer.n_rows() != vertex) continue;
        if (Status s = append(c, item, 1, where, "vertex", index); !s) return s;
    }
    return {};
}

Result<uint32_t> LayerReader::add_face(const Item& item, size_t n_corners, const std::string& where, uint64_t index) {
    const auto first = static_cast<uint32_t>(face_of_corner_.size());
    if (!has_face_layers_) return first;
    for (Column& c : columns_) {
        if (c.layer.domain == LayerDomain::point) continue;
        const size_t n_rows = c.layer.domain == LayerDomain::corner ? n_corners : 1;
        if (Status s = append(c, item, n_rows, where, "face", index); !s) return s.error();
    }
    face_of_corner_.insert(face_of_corner_.end(), n_corners, n_faces_++);
    return first;
}

std::vector<MeshLayer> LayerReader::finish(size_t n_vertices, const std::vector<uint32_t>& corner_number) {
    std::vector<MeshLayer> layers;
    for (Column& c : columns_) {
        const MeshLayer of_file = std::move(c.layer);
        MeshLayer layer(static_cast<const LayerId&>(of_file));
        if (layer.domain == LayerDomain::point) {
            layer.values = of_file.values;
            layer.values.resize(n_vertices * layer.width);
        }
        const auto take = [&](size_t row) {
            layer.values.insert(layer.values.end(), of_file.row(row), of_file.row(row) + layer.width);
        };
        for (size_t k = 0; k < corner_number.size(); ++k) {
            if (layer.domain == LayerDomain::corner) take(corner_number[k]);
            if (layer.domain == LayerDomain::face && k % 3 == 0) take(face_of_corner_[corner_number[k]]);
        }
        layers.push_back(std::move(layer));
    }
    return layers;
}

}  // namespace sunder
