// Concave polygons with areas in closed form, and prisms over them.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <string>
#include <vector>

#include "solver/data/math.h"

namespace sunder::testing {

struct NamedPolygon {
    std::string name;
    std::vector<Vec3> corners;  // counter-clockwise in the plane z = 0
};

/// Shoelace formula, z = 0.
inline double area_of_polygon(const std::vector<Vec3>& corners) {
    double twice = 0;
    for (size_t k = 0; k < corners.size(); ++k) {
        const Vec3 &p = corners[k], &q = corners[(k + 1) % corners.size()];
        twice += p.x() * q.y() - q.x() * p.y();
    }
    return 0.5 * twice;
}

/// Many of their corners lie in a row, where a careless cut leaves triangles of no area.
inline std::vector<NamedPolygon> concave_polygons() {
    auto flat = [](const std::vector<std::array<double, 2>>& places) {
        std::vector<Vec3> corners;
        for (const auto& [x, y] : places) corners.push_back(Vec3(x, y, 0));
        return corners;
    };
    return {{"L", flat({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}})},
            {"T", flat({{1, 0}, {2, 0}, {2, 1}, {3, 1}, {3, 2}, {0, 2}, {0, 1}, {1, 1}})},
            {"comb",
             flat({{0, 0}, {5, 0}, {5, 2}, {4, 2}, {4, 1}, {3, 1}, {3, 2}, {2, 2}, {2, 1}, {1, 1}, {1, 2}, {0, 2}})},
            {"star", flat({{0, 0}, {2, 1}, {4, 0}, {3, 2}, {4, 4}, {2, 3}, {0, 4}, {1, 2}})},
            {"dart", flat({{0, 0}, {2, 1}, {4, 0}, {2, 4}})},
            {"L with corners in a row", flat({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}, {0, 1}})},
            {"square with a hole and a bridge",
             flat({{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}})},
            {"L with a hole in each arm", flat({{0, 0},
                                                {6, 0},
                                                {6, 3},
                                                {3, 3},
                                                {3, 6},
                                                {0, 6},
                                                {0, 0},
                                                {1, 1},
                                                {1, 2},
                                                {2, 2},
                                                {2, 1},
                                                {4, 1},
                                                {4, 2},
                                                {5, 2},
                                                {5, 1},
                                                {4, 1},
                                                {2, 1},
                                                {1, 1}})}};
}

/// Turned about an axis along no other, then moved.
inline std::vector<Vec3> placed(std::vector<Vec3> points, double angle, const Vec3& shift) {
    const Quat turn(Eigen::AngleAxisd(angle, Vec3(0.36, -0.48, 0.8)));
    for (Vec3& p : points) p = shift + (angle == 0 ? p : turn * p);
    return points;
}

/// A polygon from z = 0 to z = 1: its vertices, and faces with corners in their order.
struct Prism {
    std::vector<Vec3> vertices;
    std::vector<std::vector<uint32_t>> faces;  // the two caps, then the sides
};

/// `start`: the corner that caps begin with.
inline Prism make_prism(const std::vector<Vec3>& corners, size_t start = 0) {
    Prism prism;
    std::vector<uint32_t> vertex;
    for (const Vec3& p : corners) {
        const auto at = std::ranges::find(prism.vertices, p);
        vertex.push_back(uint32_t(at - prism.vertices.begin()));
        if (at == prism.vertices.end()) prism.vertices.push_back(p);
    }
    const auto n = uint32_t(prism.vertices.size());
    for (uint32_t v = 0; v < n; ++v) prism.vertices.push_back(prism.vertices[v] + Vec3::UnitZ());
    std::rotate(vertex.begin(), vertex.begin() + std::ptrdiff_t(start), vertex.end());
    prism.faces.assign(2, {});
    for (uint32_t v : vertex) prism.faces[0].insert(prism.faces[0].begin(), v), prism.faces[1].push_back(v + n);
    for (size_t k = 0; k < vertex.size(); ++k) {
        const uint32_t v = vertex[k], w = vertex[(k + 1) % vertex.size()];
        bool is_bridge = false;  // it runs there and back
        for (size_t m = 0; m < vertex.size(); ++m) is_bridge |= vertex[m] == w && vertex[(m + 1) % vertex.size()] == v;
        if (!is_bridge) prism.faces.push_back({v, w, w + n, v + n});
    }
    return prism;
}

}  // namespace sunder::testing
