#include "fracture_tools/mesh/corner_normals.h"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <tuple>

#include "solver/data/disjoint_sets.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

/// Of the height of a triangle, as a share of its longest edge: less is rounding.
constexpr double kFlat = 1e-12;

double angle_between(const Vec3& u, const Vec3& v) { return math::atan2(u.cross(v).norm(), u.dot(v)); }

bool is_flat(MeshView mesh, const Triangle& t) {
    const Vec3 u = mesh.positions[t[1]] - mesh.positions[t[0]], v = mesh.positions[t[2]] - mesh.positions[t[0]];
    return !(u.cross(v).norm() > kFlat * std::max({u.squaredNorm(), v.squaredNorm(), (u - v).squaredNorm()}));
}

/// Unit normals; triangles without area have that of the neighbour across their longest edge, or of its neighbour.
std::vector<Vec3> triangle_normals(MeshView mesh) {
    std::vector<Vec3> normal;
    std::map<std::array<uint32_t, 2>, std::vector<uint32_t>> at_edge;  // of triangles without area
    auto side = [](const Triangle& t, int c) {
        const auto [low, high] = std::minmax(t[c], t[(c + 1) % 3]);
        return std::array{low, high};
    };
    std::vector<uint32_t> flat;
    for (uint32_t k = 0; k < mesh.triangles.size(); ++k) {
        const auto& [a, b, c] = mesh.triangles[k];
        const Vec3 n = (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
        if (is_flat(mesh, mesh.triangles[k])) flat.push_back(k);
        normal.push_back(!flat.empty() && flat.back() == k ? Vec3::Zero() : Vec3(n.normalized()));
    }
    if (flat.empty()) return normal;
    for (uint32_t k : flat)
        for (int c = 0; c < 3; ++c) at_edge[side(mesh.triangles[k], c)];
    for (uint32_t k = 0; k < mesh.triangles.size(); ++k)
        for (int c = 0; c < 3; ++c)
            if (const auto at = at_edge.find(side(mesh.triangles[k], c)); at != at_edge.end()) at->second.push_back(k);
    for (bool any = true; any;) {
        any = false;
        for (uint32_t k : flat) {
            if (!normal[k].isZero(0)) continue;
            double longest = -1;
            for (int c = 0; c < 3; ++c) {
                const Triangle& t = mesh.triangles[k];
                const double length = (mesh.positions[t[c]] - mesh.positions[t[(c + 1) % 3]]).squaredNorm();
                for (uint32_t other : at_edge[side(t, c)])
                    if (!normal[other].isZero(0) && length > longest) longest = length, normal[k] = normal[other];
            }
            any |= longest >= 0;
        }
    }
    return normal;
}

/// Lowest corner that a corner shares its normal with.
std::vector<uint32_t> smooth_groups(MeshView mesh, const std::vector<Vec3>& normal, double least_cosine) {
    struct Side {
        uint32_t low, high, corner;
    };
    std::vector<Side> sides;
    for (uint32_t k = 0; k < 3 * mesh.triangles.size(); ++k) {
        const Triangle& t = mesh.triangles[k / 3];
        const auto [low, high] = std::minmax(t[k % 3], t[(k + 1) % 3]);
        sides.push_back({low, high, k});
    }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
        return std::tie(x.low, x.high, x.corner) < std::tie(y.low, y.high, y.corner);
    });
    std::vector<uint32_t> group = disjoint_sets(sides.size());
    auto next = [](uint32_t corner) { return corner - corner % 3 + (corner + 1) % 3; };
    for (size_t i = 0; i + 1 < sides.size(); ++i) {
        if (sides[i].low != sides[i + 1].low || sides[i].high != sides[i + 1].high) continue;
        const uint32_t k = sides[i].corner, l = sides[i + 1].corner;
        if (normal[k / 3].dot(normal[l / 3]) < least_cosine) continue;
        const bool opposite = mesh.triangles[k / 3][k % 3] != mesh.triangles[l / 3][l % 3];
        unite(group, k, opposite ? next(l) : l);
        unite(group, next(k), opposite ? l : next(l));
    }
    for (uint32_t c = 0; c < group.size(); ++c) group[c] = lowest(group, c);
    return group;
}

}  // namespace

std::vector<Vec3f> smooth_corner_normals(MeshView mesh, double smooth_angle) {
    const std::vector<Vec3> normal = triangle_normals(mesh);
    const std::vector<uint32_t> group = smooth_groups(mesh, normal, math::cos(smooth_angle * std::numbers::pi / 180));
    std::vector<Vec3> sum(group.size(), Vec3::Zero());
    for (uint32_t k = 0; k < group.size(); ++k) {
        const Triangle& t = mesh.triangles[k / 3];
        if (is_flat(mesh, t)) continue;
        const Vec3& p = mesh.positions[t[k % 3]];
        sum[group[k]] +=
            angle_between(mesh.positions[t[(k + 1) % 3]] - p, mesh.positions[t[(k + 2) % 3]] - p) * normal[k / 3];
    }
    std::vector<Vec3f> corner(group.size());
    for (uint32_t k = 0; k < group.size(); ++k) {
        const Vec3& n = sum[group[k]].norm() > 1e-6 ? sum[group[k]] : normal[k / 3];
        corner[k] = n.normalized().cast<float>();
    }
    return corner;
}

}  // namespace sunder
