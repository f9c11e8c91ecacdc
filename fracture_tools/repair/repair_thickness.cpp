#include "fracture_tools/repair/repair_thickness.h"

#include <algorithm>
#include <vector>

#include "fracture_tools/repair/repair_attributes.h"
#include "solver/data/ids.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr double kDeepest = 2;  // times the thickness

/// Angle of a triangle at its corner c.
double angle_at(const TriMesh& m, const Triangle& t, int c) {
    const Vec3 u = m.positions[t[(c + 1) % 3]] - m.positions[t[c]], v = m.positions[t[(c + 2) % 3]] - m.positions[t[c]];
    return math::atan2(u.cross(v).norm(), u.dot(v));
}

Vec3 normal_of(const TriMesh& m, const Triangle& t) {
    return (m.positions[t[1]] - m.positions[t[0]]).cross(m.positions[t[2]] - m.positions[t[0]]).normalized();
}

/// How far vertices of marked triangles go inward: along the mean of the triangles' normals weighted by their angles.
std::vector<Vec3> inward_steps(const TriMesh& mesh, std::span<const uint8_t> marked, double thickness) {
    std::vector<Vec3> direction(mesh.positions.size(), Vec3::Zero());
    std::vector<double> least_cosine(mesh.positions.size(), 1);
    for (uint32_t t = 0; t < marked.size(); ++t)
        for (int c = 0; marked[t] && c < 3; ++c)
            direction[mesh.triangles[t][c]] +=
                angle_at(mesh, mesh.triangles[t], c) * normal_of(mesh, mesh.triangles[t]);
    for (Vec3& d : direction) d.normalize();
    for (uint32_t t = 0; t < marked.size(); ++t) {
        const Vec3 n = normal_of(mesh, mesh.triangles[t]);
        for (uint32_t v : mesh.triangles[t])
            if (marked[t] && !n.isZero(0)) least_cosine[v] = std::min(least_cosine[v], n.dot(direction[v]));
    }
    for (uint32_t v = 0; v < direction.size(); ++v)
        direction[v] *= -thickness / std::max(least_cosine[v], 1 / kDeepest);
    return direction;
}

}  // namespace

void thicken(TriMesh& io_mesh, std::span<const uint8_t> marked, double thickness) {
    const std::vector<Vec3> step = inward_steps(io_mesh, marked, thickness);
    std::vector<uint32_t> inner(io_mesh.positions.size(), kNone);
    const auto n_triangles = static_cast<uint32_t>(io_mesh.triangles.size());

    struct Side {
        uint32_t low, high, corner;
        bool operator<(const Side& o) const { return std::tie(low, high, corner) < std::tie(o.low, o.high, o.corner); }
    };
    std::vector<Side> sides;
    for (uint32_t t = 0; t < n_triangles; ++t) {
        if (!marked[t]) continue;
        const Triangle outer = io_mesh.triangles[t];
        for (uint32_t c = 0; c < 3; ++c) {
            const uint32_t v = outer[c], w = outer[(c + 1) % 3];
            sides.push_back({std::min(v, w), std::max(v, w), 3 * t + c});
            if (inner[v] != kNone) continue;
            inner[v] = append_vertex(io_mesh, io_mesh.positions[v] + step[v], v);
        }
        std::array<Vec3f, 3> normals;
        for (uint32_t c = 0; c < 3; ++c)
            normals[c] = io_mesh.corner_normals.empty() ? Vec3f::Zero() : Vec3f(-io_mesh.corner_normals[3 * t + c]);
        append_triangle(io_mesh, {inner[outer[0]], inner[outer[2]], inner[outer[1]]},
                        std::array{3 * t, 3 * t + 2, 3 * t + 1}, std::array{normals[0], normals[2], normals[1]});
    }
    std::sort(sides.begin(), sides.end());
    for (size_t i = 0; i < sides.size(); ++i) {
        const auto same = [&](size_t j) {
            return j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;
        };
        if (same(i + 1) || (i > 0 && same(i - 1))) continue;
        const uint32_t at_v = sides[i].corner, at_w = at_v - at_v % 3 + (at_v + 1) % 3;
        const uint32_t v = io_mesh.triangles[at_v / 3][at_v % 3], w = io_mesh.triangles[at_w / 3][at_w % 3];
        const Vec3f n =
            (io_mesh.positions[v] - io_mesh.positions[w]).cross(step[v] + step[w]).normalized().cast<float>();
        append_triangle(io_mesh, {w, v, inner[v]}, std::array{at_w, at_v, at_v}, std::array{n, n, n});
        append_triangle(io_mesh, {w, inner[v], inner[w]}, std::array{at_w, at_v, at_w}, std::array{n, n, n});
    }
    // The inner side of a group's vertices belongs to the group.
    for (auto& [name, vertices] : io_mesh.vertex_groups) {
        const size_t n = vertices.size();
        for (size_t k = 0; k < n; ++k)
            if (vertices[k] < inner.size() && inner[vertices[k]] != kNone) vertices.push_back(inner[vertices[k]]);
        std::sort(vertices.begin(), vertices.end());
    }
}

}  // namespace sunder
