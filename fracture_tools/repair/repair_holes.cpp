#include "fracture_tools/repair/repair_holes.h"

#include <algorithm>
#include <map>
#include <set>

#include "fracture_tools/mesh/point_grid.h"
#include "fracture_tools/repair/repair_attributes.h"
#include "fracture_tools/repair/repair_surface.h"
#include "solver/data/disjoint_sets.h"
#include "solver/data/ids.h"

namespace sunder {
namespace {

/// Which vertices are joined by an edge: a patch that joins them once more would have an edge with four triangles.
class EdgeSet {
public:
    explicit EdgeSet(const MeshView& mesh) {
        for (const Triangle& t : mesh.triangles)
            for (int c = 0; c < 3; ++c) edges_.insert(undirected(t[c], t[(c + 1) % 3]));
    }
    bool has_diagonal_of(const std::vector<Triangle>& patch, const std::vector<uint32_t>& corners) const {
        for (const Triangle& t : patch)
            for (int c = 0; c < 3; ++c) {
                const uint32_t i = t[c], j = t[(c + 1) % 3], apart = i < j ? j - i : i - j;
                if (apart == 1 || apart + 1 == corners.size()) continue;
                if (edges_.contains(undirected(corners[i], corners[j]))) return true;
            }
        return false;
    }
    void add(const std::vector<Triangle>& patch, const std::vector<uint32_t>& corners) {
        for (const Triangle& t : patch)
            for (int c = 0; c < 3; ++c) edges_.insert(undirected(corners[t[c]], corners[t[(c + 1) % 3]]));
    }

private:
    static std::array<uint32_t, 2> undirected(uint32_t v, uint32_t w) { return {std::min(v, w), std::max(v, w)}; }
    std::set<std::array<uint32_t, 2>> edges_;
};

/// Around one more point, the n-th.
std::vector<Triangle> fan(uint32_t n) {
    std::vector<Triangle> triangles;
    for (uint32_t i = 0; i < n; ++i) triangles.push_back({i, (i + 1) % n, n});
    return triangles;
}

}  // namespace

std::vector<OpenEdge> find_open_edges(const MeshView& mesh) {
    using Side = std::array<uint32_t, 3>;  // from, to, corner
    std::vector<Side> all;
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (uint32_t c = 0; c < 3; ++c)
            all.push_back({mesh.triangles[t][c], mesh.triangles[t][(c + 1) % 3], 3 * t + c});
    std::sort(all.begin(), all.end());
    std::vector<OpenEdge> open;
    for (const auto& [from, to, corner] : all) {
        const auto at = std::lower_bound(all.begin(), all.end(), Side{to, from, 0});
        if (at == all.end() || (*at)[0] != to || (*at)[1] != from) open.push_back({from, to, corner});
    }
    return open;
}

std::vector<Border> find_borders(const MeshView& mesh) {
    // What is missing runs the other way; in a vertex with one fan of triangles it arrives once and leaves once.
    std::vector<uint32_t> next(mesh.positions.size(), kNone);
    for (const OpenEdge& edge : find_open_edges(mesh)) next[edge.to] = edge.from;
    std::vector<Border> borders;
    for (uint32_t start = 0; start < next.size(); ++start) {
        if (next[start] == kNone) continue;
        Border border;
        for (uint32_t v = start, to; v != kNone && next[v] != kNone; v = to) {
            to = std::exchange(next[v], kNone);
            border.vertices.push_back(v);
            border.length += (mesh.positions[to] - mesh.positions[v]).norm();
        }
        borders.push_back(std::move(border));
    }
    return borders;
}

size_t weld_borders(TriMesh& io_mesh, const std::vector<Border>& borders, double tolerance) {
    std::vector<uint32_t> vertices;
    std::vector<Vec3> points;
    for (const Border& b : borders) vertices.insert(vertices.end(), b.vertices.begin(), b.vertices.end());
    std::sort(vertices.begin(), vertices.end());
    for (uint32_t v : vertices) points.push_back(io_mesh.positions[v]);
    if (points.empty()) return 0;
    const PointGrid grid(points);
    std::vector<uint32_t> goes_to = disjoint_sets(points.size());
    for (uint32_t i = 0; i < points.size(); ++i)
        grid.visit_near(points[i], tolerance, [&](uint32_t j) {
            if (j < i && (points[j] - points[i]).norm() <= tolerance) unite(goes_to, i, j);
        });
    size_t n_moved = 0;
    for (uint32_t i = 0; i < points.size(); ++i) {
        const Vec3& to = points[lowest(goes_to, i)];
        n_moved += to != points[i];
        io_mesh.positions[vertices[i]] = to;
    }
    return n_moved;
}

Status close_borders(TriMesh& io_mesh, const std::vector<Border>& borders, const Progress& progress) {
    if (borders.empty()) return {};
    std::map<uint32_t, uint32_t> corner_at;  // of a vertex of a border: a corner of the surface beside it
    for (const auto& [from, to, corner] : find_open_edges(io_mesh)) {
        corner_at.emplace(from, corner);
        corner_at.emplace(to, corner - corner % 3 + (corner + 1) % 3);
    }
    EdgeSet edges(io_mesh);
    for (size_t k = 0; k < borders.size(); ++k) {
        if (!progress.report(double(k) / double(borders.size()), "closing holes")) return cancelled();
        std::vector<uint32_t> corners = borders[k].vertices;
        std::vector<Vec3> outline;
        for (uint32_t v : corners) outline.push_back(io_mesh.positions[v]);
        std::vector<Triangle> patch = fill_hole(outline);
        if (patch.empty() || edges.has_diagonal_of(patch, corners)) {
            patch = fan(static_cast<uint32_t>(corners.size()));
            Vec3 middle = Vec3::Zero();
            for (const Vec3& p : outline) middle += p / double(corners.size());
            corners.push_back(append_vertex(io_mesh, middle, corners[0]));
            corner_at[corners.back()] = corner_at[corners[0]];
            outline.push_back(middle);
        }
        edges.add(patch, corners);
        for (const auto& [i, j, m] : patch) {
            const Vec3f n = (outline[j] - outline[i]).cross(outline[m] - outline[i]).normalized().cast<float>();
            append_triangle(io_mesh, {corners[i], corners[j], corners[m]},
                            std::array{corner_at[corners[i]], corner_at[corners[j]], corner_at[corners[m]]},
                            std::array{n, n, n});
        }
    }
    return {};
}

}  // namespace sunder
