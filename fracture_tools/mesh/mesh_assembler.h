// Triangles of a file put together into one mesh, welded by position.
#pragma once

#include <array>
#include <span>
#include <unordered_map>
#include <vector>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// What a reader knows of one corner.
struct FileCorner {
    uint32_t vertex = 0;  // as weld() gave it
    Vec2f uv = Vec2f::Zero();
    Vec3 normal = Vec3::Zero();  // any length; 0: none, the triangle's own is taken
    Color color = {1, 1, 1, 1};
    uint32_t number = 0;  // of the corner in the file, for keep_corner_numbers()
};

/// Vertices at one position (bit for bit; -0 is 0) become one. Triangles with two corners at one position are dropped.
class MeshAssembler {
public:
    /// Which attributes corners shall have.
    MeshAssembler(bool has_uvs, bool has_normals, bool has_colors)
        : has_uvs_(has_uvs), has_normals_(has_normals), has_colors_(has_colors) {}

    /// From now on the mesh's corners are told by the numbers of those in the file.
    void keep_corner_numbers() { keeps_numbers_ = true; }
    const std::vector<uint32_t>& corner_numbers() const { return corner_number_; }  // (3 n_triangles)

    uint32_t weld(const Vec3& position);

    /// Cuts a polygon into triangles (triangulate_polygon): any one, also with holes that an edge joins to its outline.
    void add_polygon(std::span<const FileCorner> corners, int32_t material);

    /// Triangles so far.
    size_t n_triangles() const { return mesh_.triangles.size(); }

    TriMesh finish() { return std::move(mesh_); }

private:
    struct Hash {
        size_t operator()(const std::array<double, 3>& p) const;
    };
    void add_triangle(const FileCorner& a, const FileCorner& b, const FileCorner& c, int32_t material);

    bool has_uvs_, has_normals_, has_colors_, keeps_numbers_ = false;
    std::vector<uint32_t> corner_number_;
    std::unordered_map<std::array<double, 3>, uint32_t, Hash> vertex_;  // looked up only: its order has no effect
    TriMesh mesh_;
};

}  // namespace sunder
