#include "nodes/files/mesh_frame_reader.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <map>
#include <optional>

#include "fracture_tools/mesh/layer_property.h"
#include "fracture_tools/mesh/utf8_text.h"
#include "nodes/files/mesh_frame_file.h"
#include "nodes/files/ply_file.h"

namespace sunder {
namespace {

// The rows of an element whose lists have the same length in every row, as all that we write have.
class Table {
public:
    static std::optional<Table> of(const PlyFile& file, const char* name) {
        const PlyElement* element = file.find(name);
        if (!element) return std::nullopt;
        Table table;
        table.first_ = file.rows(*element), table.n_rows = element->count;
        std::vector<std::pair<size_t, uint8_t>> lengths;  // where, and what every row must have there
        for (const PlyProperty& p : element->properties) {
            size_t n = 1;
            if (p.count_type) {
                if (*p.count_type != PlyType::uint8) return std::nullopt;
                n = table.n_rows > 0 ? read_number<uint8_t>(table.first_ + table.stride_) : 0;
                lengths.emplace_back(table.stride_, static_cast<uint8_t>(n));
                table.stride_ += 1;
            }
            table.columns_[p.name] = {table.stride_, p.type, n};
            table.order_.push_back(p.name);
            table.stride_ += n * ply_size(p.type);
        }
        // Rows were counted by the file's parser; once all lists fit, every row is where this says.
        for (size_t row = 0; row < table.n_rows; ++row)
            for (const auto& [offset, n] : lengths)
                if (read_number<uint8_t>(table.at(row) + offset) != n) return std::nullopt;
        return table;
    }

    /// Fills `out` with N numbers of a row for each row; false: there is no such column.
    template <class N, size_t Width>
    bool read(const char* name, PlyType type, std::vector<std::array<N, Width>>& out) const {
        const auto column = columns_.find(name);
        if (column == columns_.end() || column->second.type != type) return false;
        if (n_rows > 0 && column->second.count != Width) return false;
        out.resize(n_rows);
        for (size_t row = 0; row < n_rows; ++row)
            std::memcpy(out[row].data(), at(row) + column->second.offset, sizeof(N) * Width);
        return true;
    }

    /// Layers among the columns, as LayerColumns writes them; of a table without rows none: their widths are not told.
    void read_layers(bool is_face, std::vector<VisualLayer>& out) const {
        if (n_rows == 0) return;
        for (const std::string& name : order_) {
            const Column& column = columns_.at(name);
            if (column.type != PlyType::float32 && column.type != PlyType::int32) continue;
            const auto id = layer_of_property(name, is_face, column.type == PlyType::int32);
            const size_t n_corners = id && id->domain == LayerDomain::corner ? 3 : 1;
            const size_t width = column.count / n_corners;
            if (!id || column.count % n_corners != 0 || !is_layer_width(*id, width)) continue;
            std::vector<float> values(n_rows * column.count);
            for (size_t row = 0; row < n_rows; ++row)
                std::memcpy(values.data() + row * column.count, at(row) + column.offset, sizeof(float) * column.count);
            out.push_back({{id->name, id->domain, id->kind, static_cast<uint32_t>(width)}, std::move(values)});
        }
    }

    size_t n_rows = 0;

private:
    struct Column {
        size_t offset;
        PlyType type;
        size_t count;
    };
    const char* at(size_t row) const { return first_ + row * stride_; }

    const char* first_ = nullptr;
    size_t stride_ = 0;
    std::map<std::string, Column> columns_;
    std::vector<std::string> order_;  // their names as the file has them
};

// File: how the numbers are stored, where that is not as they are kept.
template <class File, class N>
bool read_as(const Table& table, const char* name, PlyType type, SharedArray<N>& out) {
    std::vector<std::array<File, 1>> rows;
    if (!table.read(name, type, rows)) return false;
    std::vector<N> values;
    values.reserve(rows.size());
    for (const auto& r : rows) values.push_back(static_cast<N>(r[0]));
    out = std::move(values);
    return true;
}

template <class N>
bool read(const Table& table, const char* name, PlyType type, SharedArray<N>& out) {
    return read_as<N>(table, name, type, out);
}

bool read_vectors(const Table& table, std::array<const char*, 3> names, SharedArray<Vec3f>& out) {
    std::vector<Vec3f> vectors(table.n_rows);
    for (int k = 0; k < 3; ++k) {
        SharedArray<float> values;
        if (!read(table, names[k], PlyType::float32, values)) return false;
        for (size_t v = 0; v < values.size(); ++v) vectors[v][k] = values[v];
    }
    out = std::move(vectors);
    return true;
}

// Rows of 3 x Width floats as three entries each.
template <size_t Width, class Entry>
bool read_corners(const Table& table, const char* name, SharedArray<Entry>& out) {
    static_assert(sizeof(Entry) == Width * sizeof(float));
    std::vector<std::array<float, 3 * Width>> rows;
    if (!table.read(name, PlyType::float32, rows)) return false;
    std::vector<Entry> corners(3 * rows.size());
    for (size_t c = 0; c < corners.size(); ++c)
        std::memcpy(static_cast<void*>(&corners[c]), rows[c / 3].data() + c % 3 * Width, sizeof(Entry));
    out = std::move(corners);
    return true;
}

// "material 3 NAME", in ascending order of the numbers.
std::vector<std::string> materials_of(const PlyHeader& header) {
    std::vector<std::string> names;
    for (const std::string& line : header.comments) {
        if (!line.starts_with(kMaterialComment)) continue;
        size_t number = 0;
        const auto [stop, code] =
            std::from_chars(line.data() + kMaterialComment.size(), line.data() + line.size(), number);
        if (code != std::errc() || number != names.size()) continue;
        names.push_back(to_utf8({std::min(stop + 1, line.data() + line.size()), line.data() + line.size()}));
    }
    return names;
}

}  // namespace

Result<MeshFrame> decode_mesh_ply(std::string bytes, const std::string& where) {
    const auto file = PlyFile::parse(std::move(bytes), where);
    if (!file) return file.error();
    const Error foreign = bad_input(where, "is not a mesh frame of this version", "bake again with --restart");
    const std::optional<Table> vertex = Table::of(*file, "vertex"), face = Table::of(*file, "face");
    if (!file->has_comment(kMeshFileMagic) || !vertex || !face) return foreign;
    MeshFrame frame;
    frame.materials = materials_of(file->header());
    VisualMesh& m = frame.mesh;
    std::vector<Triangle> triangles;
    if (!read_vectors(*vertex, {"x", "y", "z"}, m.positions) || frame.materials.empty() ||
        !face->read("vertex_indices", PlyType::int32, triangles) ||
        !read(*face, "material", PlyType::int32, m.triangle_material) ||
        !read_corners<3>(*face, "corner_normals", m.corner_normals) ||
        !read_as<int32_t>(*face, "fragment", PlyType::int32, m.triangle_fragment) ||
        !read_as<int32_t>(*vertex, "fragment", PlyType::int32, m.vertex_fragment))
        return foreign;
    m.triangles = std::move(triangles);
    read_vectors(*vertex, {"rest_x", "rest_y", "rest_z"}, m.rest_positions);
    read_vectors(*vertex, {"vx", "vy", "vz"}, m.velocities);
    read_vectors(*vertex, {"ax", "ay", "az"}, m.accelerations);
    read(*face, "hidden", PlyType::uint8, m.triangle_hidden);
    read_corners<2>(*face, "texcoord", m.corner_uvs);
    read(*face, "interface", PlyType::int32, m.triangle_interface);
    read_corners<4>(*face, "corner_colors", m.corner_colors);
    read_corners<1>(*face, "rim", m.corner_rim);
    vertex->read_layers(false, m.layers), face->read_layers(true, m.layers);
    for (size_t t = 0; t < m.triangles.size(); ++t) {
        if (std::ranges::max(m.triangles[t]) >= m.positions.size())
            return bad_input(where, "face " + std::to_string(t) + " names a vertex that is not there");
        if (m.triangle_material[t] < 0 || m.triangle_material[t] > frame.interior_material())
            return bad_input(where, "face " + std::to_string(t) + " names a material that is not there");
    }
    return frame;
}

}  // namespace sunder
