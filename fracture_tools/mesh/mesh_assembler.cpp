#include "fracture_tools/mesh/mesh_assembler.h"

#include <cmath>
#include <cstring>
#include <numeric>

#include "fracture_tools/mesh/outline_triangulation.h"

namespace sunder {
namespace {

/// Corners of a polygon that crosses or touches itself, or is flat, cut into triangles one after the other: those that
/// turn as the polygon does and hold no other corner, if there are any. Takes up to the cube of the number of corners:
/// of many a fan is made.
std::vector<Triangle> cut_ears(std::span<const Vec3> points, std::span<const uint32_t> vertex) {
    constexpr size_t kMostForEars = 300;
    auto at = [&](uint32_t k) -> const Vec3& { return points[vertex[k]]; };
    const auto n_corners = static_cast<uint32_t>(vertex.size());
    Vec3 normal = Vec3::Zero();  // twice the area vector (Newell)
    for (uint32_t k = 1; k + 1 < n_corners; ++k) normal += (at(k) - at(0)).cross(at(k + 1) - at(0));
    auto turn = [&](uint32_t a, uint32_t b, uint32_t c) { return (at(b) - at(a)).cross(at(c) - at(a)).dot(normal); };
    std::vector<Triangle> triangles;
    std::vector<uint32_t> left(n_corners);
    std::iota(left.begin(), left.end(), 0u);
    while (left.size() > 3) {
        const size_t n = left.size();
        size_t ear = n;
        for (size_t k = 1; k <= n && ear == n && n_corners <= kMostForEars; ++k) {
            const uint32_t a = left[(k + n - 1) % n], b = left[k % n], c = left[(k + 1) % n];
            if (turn(a, b, c) <= 0) continue;
            bool is_free = true;
            for (uint32_t other : left)
                is_free &= other == a || other == b || other == c ||
                           !(turn(a, b, other) >= 0 && turn(b, c, other) >= 0 && turn(c, a, other) >= 0);
            if (is_free) ear = k % n;
        }
        if (ear == n) ear = 1;  // any cut is as good
        triangles.push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    triangles.push_back({left[0], left[1], left[2]});
    return triangles;
}

}  // namespace

size_t MeshAssembler::Hash::operator()(const std::array<double, 3>& p) const {
    uint64_t h = 0;
    for (double x : p) {
        uint64_t bits;
        std::memcpy(&bits, &x, sizeof bits);
        h = (h ^ bits) * 0x9e3779b97f4a7c15ull;
        h ^= h >> 29;
    }
    return h;
}

uint32_t MeshAssembler::weld(const Vec3& p) {
    const std::array<double, 3> key = {p.x() + 0.0, p.y() + 0.0, p.z() + 0.0};
    const auto [at, is_new] = vertex_.try_emplace(key, static_cast<uint32_t>(mesh_.positions.size()));
    if (is_new) mesh_.positions.push_back(Vec3(key[0], key[1], key[2]));
    return at->second;
}

void MeshAssembler::add_triangle(const FileCorner& a, const FileCorner& b, const FileCorner& c, int32_t material) {
    if (a.vertex == b.vertex || b.vertex == c.vertex || c.vertex == a.vertex) return;
    mesh_.triangles.push_back({a.vertex, b.vertex, c.vertex});
    mesh_.triangle_material.push_back(material);
    const auto& p = mesh_.positions;
    const Vec3 own = (p[b.vertex] - p[a.vertex]).cross(p[c.vertex] - p[a.vertex]);
    for (const FileCorner* corner : {&a, &b, &c}) {
        if (keeps_numbers_) corner_number_.push_back(corner->number);
        if (has_uvs_) mesh_.corner_uvs.push_back(corner->uv.allFinite() ? corner->uv : Vec2f::Zero());
        if (has_normals_) {
            const bool has_own = !corner->normal.allFinite() || corner->normal.norm() == 0;
            mesh_.corner_normals.push_back((has_own ? own : corner->normal).normalized().cast<float>());
        }
        if (has_colors_) {
            mesh_.corner_colors.push_back(corner->color);
            for (float& c : mesh_.corner_colors.back()) c = std::isfinite(c) ? c : 1.0f;
        }
    }
}

void MeshAssembler::add_polygon(std::span<const FileCorner> corners, int32_t material) {
    std::vector<FileCorner> kept;
    for (size_t k = 0; k < corners.size(); ++k)
        if (corners[k].vertex != corners[(k + 1) % corners.size()].vertex) kept.push_back(corners[k]);
    if (kept.size() < 3) return;
    if (kept.size() == 3) return add_triangle(kept[0], kept[1], kept[2], material);
    std::vector<uint32_t> vertex;
    for (const FileCorner& c : kept) vertex.push_back(c.vertex);
    const auto triangles = triangulate_polygon(mesh_.positions, vertex);
    for (const auto& [a, b, c] : triangles ? *triangles : cut_ears(mesh_.positions, vertex))
        add_triangle(kept[a], kept[b], kept[c], material);
}

}  // namespace sunder
