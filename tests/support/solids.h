// Closed meshes for collider tests, fine enough to stand for the smooth solids.
#pragma once

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "solver/data/tri_mesh.h"

namespace sunder::test {

/// An octahedron with each triangle divided into four, `levels` times; its vertices lie on the sphere.
inline TriMesh ball(double radius, int levels, const Vec3& center = Vec3::Zero()) {
    TriMesh m;
    m.positions = {Vec3::UnitX(), -Vec3::UnitX(), Vec3::UnitY(), -Vec3::UnitY(), Vec3::UnitZ(), -Vec3::UnitZ()};
    m.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        const auto middle = [&](uint32_t a, uint32_t b) {
            const auto [at, is_new] = middles.insert({std::minmax(a, b), uint32_t(m.positions.size())});
            if (is_new) m.positions.push_back((m.positions[a] + m.positions[b]).normalized());
            return at->second;
        };
        std::vector<Triangle> finer;
        for (const auto& [a, b, c] : m.triangles) {
            const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            for (const Triangle& t : {Triangle{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}}) finer.push_back(t);
        }
        m.triangles = std::move(finer);
    }
    for (Vec3& p : m.positions) p = center + radius * p;
    return m;
}

/// Around the z axis, radii of the ring and of the tube.
inline TriMesh ring(double radius, double tube, int n_ring, int n_tube) {
    TriMesh m;
    const auto at = [&](int i, int j) { return uint32_t((i % n_ring) * n_tube + j % n_tube); };
    for (int i = 0; i < n_ring; ++i)
        for (int j = 0; j < n_tube; ++j) {
            const double u = 2 * std::numbers::pi * i / n_ring, v = 2 * std::numbers::pi * j / n_tube;
            const double r = radius + tube * std::cos(v);
            m.positions.emplace_back(r * std::cos(u), r * std::sin(u), tube * std::sin(v));
            m.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            m.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return m;
}

/// A block whose top is a height: n x n quads over a square of `side` about the z axis, its bottom at z = `bottom`.
template <class Height>
TriMesh terrain(double side, int n, double bottom, const Height& height) {
    TriMesh m;
    const auto at = [&](int i, int j, int top) { return uint32_t(2 * (i * (n + 1) + j) + top); };
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j) {
            const double x = side * (double(i) / n - 0.5), y = side * (double(j) / n - 0.5);
            m.positions.emplace_back(x, y, bottom);
            m.positions.emplace_back(x, y, height(x, y));
        }
    const auto quad = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
        m.triangles.push_back({a, b, c});
        m.triangles.push_back({a, c, d});
    };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            quad(at(i, j, 1), at(i + 1, j, 1), at(i + 1, j + 1, 1), at(i, j + 1, 1));
            quad(at(i, j, 0), at(i, j + 1, 0), at(i + 1, j + 1, 0), at(i + 1, j, 0));
        }
    for (int k = 0; k < n; ++k) {
        quad(at(k, 0, 0), at(k + 1, 0, 0), at(k + 1, 0, 1), at(k, 0, 1));
        quad(at(k + 1, n, 0), at(k, n, 0), at(k, n, 1), at(k + 1, n, 1));
        quad(at(0, k + 1, 0), at(0, k, 0), at(0, k, 1), at(0, k + 1, 1));
        quad(at(n, k, 0), at(n, k + 1, 0), at(n, k + 1, 1), at(n, k, 1));
    }
    return m;
}

inline TriMesh block(const Vec3& low, const Vec3& high) {
    TriMesh m = terrain(1, 1, 0, [](double, double) { return 1.0; });
    for (Vec3& p : m.positions)
        for (int i = 0; i < 3; ++i) p[i] = p[i] > 0.25 ? high[i] : low[i];
    return m;
}

}  // namespace sunder::test
