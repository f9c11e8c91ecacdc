// Meshes as they come: each with one danger, made on purpose.
#pragma once

#include <functional>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "fracture_tools/fragments/prefracture.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder::testing {

struct UglyMesh {
    std::string name, what;          // test name; the danger, in words
    std::function<TriMesh()> make;   //
    std::string expected;            // part of the warning or error that names it; empty: cut without a word
    bool is_cut = true;              // else refused
    double volume = 0;               // of the repaired solid, where it is known, m3
    double volume_tolerance = 1e-9;  // share; a wrap's is larger
    RepairSettings repair = {.wrap_detail = 0.04};
};

inline void PrintTo(const UglyMesh& ugly, std::ostream* out) { *out << ugly.what; }

/// Each corner moved by up to `amount`.
inline TriMesh shaken(TriMesh mesh, double amount, uint32_t seed) {
    std::mt19937 random(seed);
    for (Vec3& p : mesh.positions)
        for (int k = 0; k < 3; ++k) p[k] += amount * (2 * double(random()) / 4294967295.0 - 1);
    return mesh;
}
inline TriMesh scaled(TriMesh mesh, double by) {
    for (Vec3& p : mesh.positions) p *= by;
    return mesh;
}
inline TriMesh shifted(TriMesh mesh, const Vec3& by) {
    for (Vec3& p : mesh.positions) p += by;
    return mesh;
}
inline TriMesh without(TriMesh mesh, const std::vector<size_t>& triangles_descending) {
    for (size_t t : triangles_descending) mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(t));
    return mesh;
}
/// A height field over [0, 1]^2, n x n squares, open.
inline TriMesh make_sheet(int n, const std::function<double(double, double)>& height) {
    TriMesh mesh;
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) {
            const double x = double(i) / n, y = double(j) / n;
            mesh.positions.push_back(Vec3(x, y, height(x, y)));
        }
    auto id = [&](int i, int j) { return uint32_t(j * (n + 1) + i); };
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            mesh.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
            mesh.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
        }
    return mesh;
}
inline TriMesh make_waves() {
    return make_sheet(12, [](double x, double y) { return 0.1 * std::sin(5 * x) * std::cos(4 * y); });
}
/// A band with half a twist: one side, one border.
inline TriMesh make_moebius(int n = 40) {
    TriMesh mesh;
    for (int i = 0; i < n; ++i)
        for (double s : {-0.15, 0.15}) {
            const double u = 2 * std::numbers::pi * i / n, r = 0.5 + s * std::cos(u / 2);
            mesh.positions.push_back(Vec3(r * std::cos(u), r * std::sin(u), s * std::sin(u / 2)));
        }
    for (int i = 0; i < n; ++i) {
        const uint32_t a = 2 * i, b = a + 1;
        const uint32_t c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? a + 3 : 0;
        mesh.triangles.push_back({a, c, b});
        mesh.triangles.push_back({b, c, d});
    }
    return mesh;
}
/// Closed, one-sided, crosses itself.
inline TriMesh make_klein_bottle(int n = 24) {
    TriMesh mesh;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double u = 2 * std::numbers::pi * i / n, v = 2 * std::numbers::pi * j / n;
            const double w = std::cos(u / 2) * std::sin(v) - std::sin(u / 2) * std::sin(2 * v), r = 1 + 0.4 * w;
            const double z = std::sin(u / 2) * std::sin(v) + std::cos(u / 2) * std::sin(2 * v);
            mesh.positions.push_back(Vec3(r * std::cos(u), r * std::sin(u), 0.4 * z));
        }
    auto id = [&](int i, int j) {  // once round turns the section over
        const int k = i == n ? (n - j) % n : j % n;
        return uint32_t((i % n) * n + k);
    };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            mesh.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
            mesh.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
        }
    return mesh;
}
/// A box's lower face without the middle of one of its edges, which the face beside it has.
inline TriMesh with_t_junction() {
    TriMesh box = make_box();
    box.positions.push_back(Vec3(0.5, 0, 0));  // on the edge 0 - 1, used by the front only: {0, 1, 5}
    for (Triangle& t : box.triangles)
        if (t == Triangle{0, 1, 5}) t = {0, 8, 5};
    box.triangles.push_back({8, 1, 5});
    return box;
}
inline TriMesh random_triangles(size_t n) {
    TriMesh mesh;
    std::mt19937 random(3);
    for (size_t v = 0; v < 3 * n; ++v) {
        const double z = random() % 1000, y = random() % 1000, x = random() % 1000;  // arguments have no order
        mesh.positions.push_back(Vec3(x, y, z) / 1000);
    }
    for (uint32_t t = 0; t < n; ++t) mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    return mesh;
}

const std::vector<UglyMesh>& ugly_meshes();

}  // namespace sunder::testing
