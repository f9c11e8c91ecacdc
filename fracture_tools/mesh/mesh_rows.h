// What vertices, corners and triangles of a mesh have, list after list, for code that treats them alike.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// Calls visit(values, n) for each list of what corners have but their normals, which turn: n entries a corner.
template <class Mesh, class Visit>
void for_corner_lists(Mesh& mesh, Visit&& visit) {
    if (!mesh.corner_uvs.empty()) visit(mesh.corner_uvs, size_t{1});
    if (!mesh.corner_colors.empty()) visit(mesh.corner_colors, size_t{1});
    for (auto& layer : mesh.layers)
        if (layer.domain == LayerDomain::corner) visit(layer.values, size_t{layer.width});
}

/// The same of vertices but their positions.
template <class Mesh, class Visit>
void for_vertex_lists(Mesh& mesh, Visit&& visit) {
    for (auto& [name, values] : mesh.vertex_attributes) visit(values, size_t{1});
    for (auto& layer : mesh.layers)
        if (layer.domain == LayerDomain::point) visit(layer.values, size_t{layer.width});
}

/// The same of triangles.
template <class Mesh, class Visit>
void for_triangle_lists(Mesh& mesh, Visit&& visit) {
    if (!mesh.triangle_material.empty()) visit(mesh.triangle_material, size_t{1});
    for (auto& layer : mesh.layers)
        if (layer.domain == LayerDomain::face) visit(layer.values, size_t{layer.width});
}

template <class T>
void append_row(std::vector<T>& io_values, size_t n, size_t row) {
    for (size_t k = 0; k < n; ++k) io_values.push_back(T(io_values[row * n + k]));
}

template <class T>
void copy_row(std::vector<T>& io_values, size_t n, size_t from, size_t to) {
    if (from != to) std::copy_n(io_values.begin() + from * n, n, io_values.begin() + to * n);
}

template <class T>
void swap_rows(std::vector<T>& io_values, size_t n, size_t a, size_t b) {
    std::swap_ranges(io_values.begin() + a * n, io_values.begin() + (a + 1) * n, io_values.begin() + b * n);
}

/// Numbers between those of three corners. In doubles, so that weights which sum to 1 leave a triangle of one colour
/// its colour.
inline void blend(const float* a, const float* b, const float* c, const Vec3& weights, size_t n, float* out) {
    for (size_t k = 0; k < n; ++k) {
        double sum = 0;
        sum += weights[0] * double(a[k]);
        sum += weights[1] * double(b[k]);
        sum += weights[2] * double(c[k]);
        out[k] = float(sum);
    }
}

/// UVs or colours of a point of a triangle, by the weights of its corners.
template <class T>
T blended(const std::vector<T>& of_corners, uint32_t triangle, const Vec3& weights) {
    static_assert(sizeof(T) % sizeof(float) == 0);
    const T* at = of_corners.data() + 3 * size_t{triangle};
    T out;
    blend(at[0].data(), at[1].data(), at[2].data(), weights, sizeof(T) / sizeof(float), out.data());
    return out;
}

/// The corner that a point of a triangle is nearest to, of several the first.
inline size_t nearest_corner(const Vec3& weights) {
    return weights[0] >= weights[1] && weights[0] >= weights[2] ? 0 : weights[1] >= weights[2] ? 1 : 2;
}

/// Layers of a mesh without any values: to be filled.
inline std::vector<MeshLayer> empty_layers(const std::vector<MeshLayer>& like) {
    std::vector<MeshLayer> layers;
    for (const MeshLayer& layer : like) layers.push_back(MeshLayer(static_cast<const LayerId&>(layer)));
    return layers;
}

/// Appends to `io_values` what a layer of `mesh` has at a point of a triangle.
inline void append_at(const TriMesh& mesh, const MeshLayer& layer, uint32_t triangle, const Vec3& weights,
                      std::vector<float>& io_values) {
    const auto row = [&](uint32_t corner) {
        return layer.row(layer.domain == LayerDomain::face     ? triangle
                         : layer.domain == LayerDomain::corner ? 3 * size_t{triangle} + corner
                                                               : mesh.triangles[triangle][corner]);
    };
    std::array<float, LayerId::kWidest> out;
    if (layer.domain == LayerDomain::face || !layer.is_blended())
        std::copy_n(row(uint32_t(nearest_corner(weights))), layer.width, out.begin());
    else
        blend(row(0), row(1), row(2), weights, layer.width, out.data());
    io_values.insert(io_values.end(), out.begin(), out.begin() + layer.width);
}

}  // namespace sunder
