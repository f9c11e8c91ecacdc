// Closed surfaces with volumes in closed form, and ways to spoil them.
#pragma once

#include <cmath>
#include <numbers>

#include "solver/data/tri_mesh.h"

namespace sunder::testing {

/// A box from the origin, 12 triangles.
inline TriMesh make_box(const Vec3& size = Vec3::Ones()) {
    TriMesh mesh;
    for (int z = 0; z < 2; ++z)
        for (int y = 0; y < 2; ++y)
            for (int x = 0; x < 2; ++x) mesh.positions.push_back(size.cwiseProduct(Vec3(x, y, z)));
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

/// Around the z axis, radii of the ring and of the tube.
inline TriMesh make_torus(double ring = 0.35, double tube = 0.15, int n_ring = 48, int n_tube = 24) {
    TriMesh mesh;
    for (int i = 0; i < n_ring; ++i)
        for (int j = 0; j < n_tube; ++j) {
            const double u = 2 * std::numbers::pi * i / n_ring, v = 2 * std::numbers::pi * j / n_tube;
            const double r = ring + tube * std::cos(v);
            mesh.positions.push_back(Vec3(r * std::cos(u), r * std::sin(u), tube * std::sin(v)));
        }
    auto id = [&](int i, int j) { return uint32_t((i % n_ring) * n_tube + j % n_tube); };
    for (int i = 0; i < n_ring; ++i)
        for (int j = 0; j < n_tube; ++j) {
            mesh.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
            mesh.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
        }
    return mesh;
}

inline void flip(Triangle& io_triangle) { std::swap(io_triangle[1], io_triangle[2]); }

inline TriMesh flipped(TriMesh mesh) {
    for (Triangle& t : mesh.triangles) flip(t);
    return mesh;
}

/// Both surfaces in one mesh; nothing is welded.
inline TriMesh joined(TriMesh a, const TriMesh& b, const Vec3& shift_of_b = Vec3::Zero()) {
    const auto base = static_cast<uint32_t>(a.positions.size());
    for (const Vec3& p : b.positions) a.positions.push_back(p + shift_of_b);
    for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    return a;
}

/// Every triangle with vertices of its own.
inline TriMesh as_soup(const TriMesh& mesh) {
    TriMesh soup;
    for (const Triangle& t : mesh.triangles) {
        const auto base = static_cast<uint32_t>(soup.positions.size());
        for (uint32_t v : t) soup.positions.push_back(mesh.positions[v]);
        soup.triangles.push_back({base, base + 1, base + 2});
    }
    return soup;
}

}  // namespace sunder::testing
