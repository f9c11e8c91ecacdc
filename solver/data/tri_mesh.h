// A triangle mesh as artists bring it: topology by position, everything else by corner.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "solver/data/math.h"
#include "solver/data/mesh_layer.h"

namespace sunder {

using Color = std::array<float, 4>;  // red, green, blue, alpha; 0 .. 1, as in the file

/// Vertices are unique by position (welded), so that a closed surface is closed by index; what differs
/// between faces at one position (UV seams, sharp normals) is kept by corner: entry 3 * triangle + corner.
struct TriMesh {
    std::vector<Vec3> positions;              // (n_vertices x 3), m
    std::vector<Triangle> triangles;          // (n_triangles x 3), counter-clockwise from outside
    std::vector<Vec2f> corner_uvs;            // (3 n_triangles x 2), or empty
    std::vector<Vec3f> corner_normals;        // (3 n_triangles x 3), unit, or empty
    std::vector<Color> corner_colors;         // (3 n_triangles), or empty
    std::vector<int32_t> triangle_material;   // (n_triangles), index into material_names, or empty (all 0)
    std::vector<std::string> material_names;  // may be empty
    std::map<std::string, std::vector<uint32_t>> vertex_groups;   // name -> vertices, ascending
    std::map<std::string, std::vector<float>> vertex_attributes;  // name -> a number each vertex (n_vertices)
    std::vector<MeshLayer> layers;  // what else comes along; a row each vertex, corner or triangle
};

/// What geometry functions read of a mesh.
struct MeshView {
    std::span<const Vec3> positions;      // (n_vertices x 3), m
    std::span<const Triangle> triangles;  // (n_triangles x 3)

    MeshView(std::span<const Vec3> p, std::span<const Triangle> t) : positions(p), triangles(t) {}
    MeshView(const TriMesh& mesh) : positions(mesh.positions), triangles(mesh.triangles) {}
};

}  // namespace sunder
