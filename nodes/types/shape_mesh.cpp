#include "nodes/types/shape_mesh.h"

#include <numbers>

#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr uint32_t kSegments = 32, kRings = 16;  // about the z axis; from pole to pole (even)

void add_triangle(TriMesh& io_mesh, Triangle t, const std::array<Vec3, 3>& normals) {
    io_mesh.triangles.push_back(t);
    for (const Vec3& n : normals) io_mesh.corner_normals.push_back(n.cast<float>());
}

// Rings of latitude from the south pole up. A capsule is a sphere whose equator is there twice, apart by its height.
TriMesh round_mesh(double radius, double half_height) {
    TriMesh mesh;
    std::vector<Vec3> normals;
    const auto add_vertex = [&](const Vec3& n, double z) {
        normals.push_back(n);
        mesh.positions.push_back(radius * n + Vec3(0, 0, z));
    };
    std::vector<std::array<double, 2>> rings;  // latitude, shift along z
    for (uint32_t r = 1; r < kRings; ++r) {
        const double latitude = std::numbers::pi * (double(r) / kRings - 0.5);
        if (r <= kRings / 2) rings.push_back({latitude, -half_height});
        if (r > kRings / 2 || (r == kRings / 2 && half_height > 0)) rings.push_back({latitude, half_height});
    }
    add_vertex(-Vec3::UnitZ(), -half_height);
    for (const auto& [latitude, z] : rings)
        for (uint32_t s = 0; s < kSegments; ++s) {
            const auto [east, north] = math::sincos(2 * std::numbers::pi * s / kSegments);
            const auto [up, out] = math::sincos(latitude);
            add_vertex(Vec3(out * north, out * east, up), z);
        }
    add_vertex(Vec3::UnitZ(), half_height);
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
        add_triangle(mesh, {a, b, c}, {normals[a], normals[b], normals[c]});
    };
    const auto n_rings = static_cast<uint32_t>(rings.size()), north = static_cast<uint32_t>(mesh.positions.size() - 1);
    for (uint32_t s = 0; s < kSegments; ++s) {
        const uint32_t next = (s + 1) % kSegments;
        add(0, 1 + next, 1 + s);
        for (uint32_t r = 0; r + 1 < n_rings; ++r) {
            const uint32_t below = 1 + r * kSegments, above = below + kSegments;
            add(below + s, below + next, above + next), add(below + s, above + next, above + s);
        }
        const uint32_t last = 1 + (n_rings - 1) * kSegments;
        add(last + s, last + next, north);
    }
    return mesh;
}

TriMesh box_mesh(const Vec3& half) {
    TriMesh mesh;
    for (uint32_t i = 0; i < 8; ++i)
        mesh.positions.push_back(
            Vec3(i & 1 ? half.x() : -half.x(), i & 2 ? half.y() : -half.y(), i & 4 ? half.z() : -half.z()));
    for (int axis = 0; axis < 3; ++axis)
        for (uint32_t side : {0u, 1u}) {
            const uint32_t u = 1u << ((axis + 1) % 3), v = 1u << ((axis + 2) % 3), at = side << axis;
            Vec3 n = Vec3::Zero();
            n[axis] = side ? 1 : -1;
            const std::array<uint32_t, 4> quad =
                side ? std::array{at, at | u, at | u | v, at | v} : std::array{at, at | v, at | u | v, at | u};
            add_triangle(mesh, {quad[0], quad[1], quad[2]}, {n, n, n});
            add_triangle(mesh, {quad[0], quad[2], quad[3]}, {n, n, n});
        }
    return mesh;
}

TriMesh square_mesh(double side) {
    TriMesh mesh;
    const double h = side / 2;
    mesh.positions = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
    const Vec3 n = Vec3::UnitZ();
    add_triangle(mesh, {0, 1, 2}, {n, n, n}), add_triangle(mesh, {0, 2, 3}, {n, n, n});
    return mesh;
}

}  // namespace

TriMesh shape_mesh(const Shape& shape, double extent) {
    switch (shape.kind) {
        case ShapeKind::sphere:
            return round_mesh(shape.radius, 0);
        case ShapeKind::capsule:
            return round_mesh(shape.radius, shape.half_height);
        case ShapeKind::box:
            return box_mesh(shape.half_extents);
        case ShapeKind::plane:
            return square_mesh(extent);
        case ShapeKind::mesh:
            break;
    }
    return {};
}

}  // namespace sunder
