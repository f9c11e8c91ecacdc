#include "fracture_tools/mesh/mesh_assembler.h"

#include <cmath>
#include <cstring>
#include <numeric>

namespace sunder {

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
    if (corners.size() < 3) return;
    if (corners.size() == 3) return add_triangle(corners[0], corners[1], corners[2], material);
    auto at = [&](uint32_t k) -> const Vec3& { return mesh_.positions[corners[k].vertex]; };
    Vec3 normal = Vec3::Zero();  // twice the area vector (Newell)
    for (uint32_t k = 0; k < corners.size(); ++k) normal += (at(k) - at(0)).cross(at((k + 1) % corners.size()) - at(0));
    std::vector<uint32_t> left(corners.size());
    std::iota(left.begin(), left.end(), 0u);
    auto turn = [&](uint32_t a, uint32_t b, uint32_t c) { return (at(b) - at(a)).cross(at(c) - at(a)).dot(normal); };
    while (left.size() > 3) {
        const size_t n = left.size();
        size_t ear = n;
        for (size_t k = 1; k <= n && ear == n; ++k) {  // from the second corner on: convex polygons become fans
            const uint32_t a = left[(k + n - 1) % n], b = left[k % n], c = left[(k + 1) % n];
            if (turn(a, b, c) <= 0) continue;
            bool is_free = true;
            for (uint32_t other : left)
                is_free &= other == a || other == b || other == c ||
                           !(turn(a, b, other) >= 0 && turn(b, c, other) >= 0 && turn(c, a, other) >= 0);
            if (is_free) ear = k % n;
        }
        if (ear == n) ear = 1;  // crossed or flat: any cut is as good
        add_triangle(corners[left[(ear + n - 1) % n]], corners[left[ear]], corners[left[(ear + 1) % n]], material);
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    add_triangle(corners[left[0]], corners[left[1]], corners[left[2]], material);
}

}  // namespace sunder
