// Layers of a mesh as vertices and faces of a PLY file tell them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "solver/data/mesh_layer.h"
#include "solver/data/result.h"

namespace sunder {

class LayerReader {
public:
    /// Of one vertex or face: what each of its properties holds.
    using Item = std::vector<std::vector<double>>;

    /// A property of vertices or faces by its name and its place in their items. False: it is no layer, or one that is
    /// there already.
    bool add(std::string_view property, size_t place, bool is_face, bool is_integer);

    /// Whether corners must be told apart (MeshAssembler::keep_corner_numbers).
    bool has_face_layers() const { return has_face_layers_; }

    /// `vertex`: which one of the mesh it is; of those at one position the first counts. Errors (`where`: the file):
    /// another number of values than a row has.
    Status add_vertex(const Item& item, uint32_t vertex, const std::string& where, uint64_t index);
    /// Gives the number of its first corner.
    Result<uint32_t> add_face(const Item& item, size_t n_corners, const std::string& where, uint64_t index);

    /// The layers of the mesh that was put together. `corner_number`: which corner of the file each of its corners is.
    std::vector<MeshLayer> finish(size_t n_vertices, const std::vector<uint32_t>& corner_number);

private:
    struct Column {
        MeshLayer layer;  // rows: welded vertices, or the file's corners or faces
        size_t place = 0;
        bool is_begun = false;  // its width is known
    };
    Status append(Column& io_column, const Item& item, size_t n_rows, const std::string& where, const char* kind,
                  uint64_t index) const;

    std::vector<Column> columns_;
    std::vector<uint32_t> face_of_corner_;
    bool has_face_layers_ = false;
    uint32_t n_faces_ = 0;
};

}  // namespace sunder
