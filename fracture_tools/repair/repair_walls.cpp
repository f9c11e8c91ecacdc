#include "fracture_tools/repair/repair_walls.h"

#include <algorithm>
#include <numeric>

#include "fracture_tools/repair/repair_attributes.h"
#include "solver/data/disjoint_sets.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

/// Less of the area than this is not what is left when walls are taken out of a solid.
constexpr double kLeastLeft = 0.3;

/// One side of a triangle's outline, around an edge.
struct Leaf {
    std::array<uint32_t, 2> edge;  // ascending
    double angle;                  // of the triangle about the edge
    uint32_t triangle;
    bool ascends;  // the triangle runs from edge[0] to edge[1]
    bool operator<(const Leaf& o) const {
        return std::tie(edge, angle, triangle) < std::tie(o.edge, o.angle, o.triangle);
    }
};

std::vector<Leaf> leaves_of(const TriMesh& mesh) {
    std::vector<Leaf> leaves;
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (int c = 0; c < 3; ++c) {
            const uint32_t v = mesh.triangles[t][c], w = mesh.triangles[t][(c + 1) % 3];
            const std::array<uint32_t, 2> edge = {std::min(v, w), std::max(v, w)};
            const Vec3 along = (mesh.positions[edge[1]] - mesh.positions[edge[0]]).normalized();
            const Vec3 out = mesh.positions[mesh.triangles[t][(c + 2) % 3]] - mesh.positions[edge[0]];
            const Vec3 right = along.unitOrthogonal(), up = along.cross(right);
            leaves.push_back({edge, math::atan2(out.dot(up), out.dot(right)), t, v < w});
        }
    std::sort(leaves.begin(), leaves.end());
    return leaves;
}

/// Cells on the two sides of triangles: 2 t + 1 is where t faces, 2 t is behind it.
std::vector<uint32_t> find_cells(const TriMesh& mesh) {
    std::vector<uint32_t> cell = disjoint_sets(2 * mesh.triangles.size());
    const std::vector<Leaf> leaves = leaves_of(mesh);
    for (size_t begin = 0, end; begin < leaves.size(); begin = end) {
        for (end = begin; end < leaves.size() && leaves[end].edge == leaves[begin].edge;) ++end;
        for (size_t k = begin; k < end; ++k) {
            const Leaf &leaf = leaves[k], &next = leaves[k + 1 < end ? k + 1 : begin];
            // A triangle that ascends faces to where angles grow.
            unite(cell, 2 * leaf.triangle + leaf.ascends, 2 * next.triangle + !next.ascends);
        }
    }
    for (uint32_t s = 0; s < cell.size(); ++s) cell[s] = lowest(cell, s);
    return cell;
}

}  // namespace

size_t weld_positions(TriMesh& io_mesh) {
    std::vector<uint32_t> order(io_mesh.positions.size()), first(io_mesh.positions.size());
    std::iota(order.begin(), order.end(), 0u);
    auto key = [&](uint32_t v) {
        const Vec3& p = io_mesh.positions[v];
        return std::array{p.x(), p.y(), p.z()};
    };
    std::sort(order.begin(), order.end(),
              [&](uint32_t v, uint32_t w) { return std::pair(key(v), v) < std::pair(key(w), w); });
    for (size_t k = 0; k < order.size(); ++k)
        first[order[k]] = k > 0 && key(order[k]) == key(order[k - 1]) ? first[order[k - 1]] : order[k];
    for (auto& [name, vertices] : io_mesh.vertex_groups) {
        for (uint32_t& v : vertices) v = first[v];
        std::sort(vertices.begin(), vertices.end());
        vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    }
    std::vector<std::pair<Triangle, uint32_t>> by_vertices;
    for (uint32_t t = 0; t < io_mesh.triangles.size(); ++t) {
        for (uint32_t& v : io_mesh.triangles[t]) v = first[v];
        Triangle sorted = io_mesh.triangles[t];
        std::sort(sorted.begin(), sorted.end());
        by_vertices.push_back({sorted, t});
    }
    std::sort(by_vertices.begin(), by_vertices.end());
    std::vector<uint8_t> mark(io_mesh.triangles.size(), 1);
    for (size_t k = 0; k < by_vertices.size(); ++k) {
        const auto& [vertices, t] = by_vertices[k];
        const bool is_point = vertices[0] == vertices[1] || vertices[1] == vertices[2];
        if (is_point || (k > 0 && vertices == by_vertices[k - 1].first)) mark[t] = 0;
    }
    keep_marked(io_mesh, mark);
    return static_cast<size_t>(std::count(mark.begin(), mark.end(), 0));
}

size_t drop_walls(TriMesh& io_mesh) {
    const std::vector<uint32_t> cell = find_cells(io_mesh);
    std::vector<double> volume(cell.size(), 0), behind(cell.size(), 0), before(cell.size(), 0);
    double all_area = 0;
    for (uint32_t t = 0; t < io_mesh.triangles.size(); ++t) {
        const auto& [a, b, c] = io_mesh.triangles[t];
        const Vec3& origin = io_mesh.positions[0];
        const Vec3 n = (io_mesh.positions[b] - io_mesh.positions[a]).cross(io_mesh.positions[c] - io_mesh.positions[a]);
        const double v = (io_mesh.positions[a] - origin).dot(n);
        volume[cell[2 * t]] += v, volume[cell[2 * t + 1]] -= v;
        behind[cell[2 * t]] += n.norm(), before[cell[2 * t + 1]] += n.norm();
        all_area += n.norm();
    }
    auto is_outer = [&](uint32_t c) { return volume[c] <= 0; };  // all around the triangles that hang together
    auto is_solid = [&](uint32_t c) { return behind[c] >= before[c]; };
    auto parts = [&](uint32_t c, uint32_t d) {
        return c != d && (is_outer(c) || is_outer(d) || is_solid(c) != is_solid(d));
    };
    std::vector<uint8_t> mark;
    double left = 0;
    for (uint32_t t = 0; t < io_mesh.triangles.size(); ++t) {
        mark.push_back(parts(cell[2 * t], cell[2 * t + 1]));
        const auto& [a, b, c] = io_mesh.triangles[t];
        if (mark.back())
            left +=
                (io_mesh.positions[b] - io_mesh.positions[a]).cross(io_mesh.positions[c] - io_mesh.positions[a]).norm();
    }
    if (left < kLeastLeft * all_area) return 0;
    keep_marked(io_mesh, mark);
    return static_cast<size_t>(std::count(mark.begin(), mark.end(), 0));
}

}  // namespace sunder
