#include "fracture_tools/voronoi/surface_vertices.h"

#include <algorithm>
#include <tuple>

namespace sunder {
namespace {

/// A name and one of the corners that has it.
struct EdgeName {
    uint32_t low, high, i, j, corner;
    auto key() const { return std::tie(low, high, i, j); }
};
struct TriangleName {
    std::array<uint32_t, 3> sites;
    uint32_t corner;
    bool leaves;
};

/// Sorts three numbers; true when that took an even number of swaps.
bool sort_is_even(std::array<uint32_t, 3>& io) {
    bool even = true;
    auto order = [&](int x, int y) {
        if (io[x] > io[y]) std::swap(io[x], io[y]), even = !even;
    };
    order(0, 1), order(1, 2), order(0, 1);
    return even;
}

class Numbering {
public:
    Numbering(MeshView mesh, std::span<const Vec3> sites, const ClippedSurface& surface, PredicateCount& io_count)
        : mesh_(mesh), sites_(sites), surface_(surface), count_(io_count) {
        out.n_mesh = static_cast<uint32_t>(mesh.positions.size());
        out.corner.resize(surface.side.size());
    }

    void run() {
        for (size_t p = 0; p < surface_.polygons.size(); ++p) {
            const SurfacePolygon& part = surface_.polygons[p];
            for (uint32_t c = part.begin; c < part.end; ++c)
                name(part, surface_.side[c == part.begin ? part.end - 1 : c - 1], surface_.side[c], c);
            const bool triangle_ends =
                p + 1 == surface_.polygons.size() || surface_.polygons[p + 1].triangle != part.triangle;
            if (triangle_ends) number_in_triangle(part.triangle);
        }
        number_on_edges();
        const uint32_t base = out.n_mesh + static_cast<uint32_t>(out.on_edges.size());
        for (const auto& [corner, vertex] : in_triangle_) out.corner[corner] = base + vertex;
    }

    SurfaceVertices out;

private:
    void name(const SurfacePolygon& part, LineLabel before, LineLabel after, uint32_t corner) {
        const Triangle& t = mesh_.triangles[part.triangle];
        if (is_triangle_edge(before) && is_triangle_edge(after)) {
            out.corner[corner] = t[3 - (before - kTriangleEdge) - (after - kTriangleEdge)];
        } else if (is_triangle_edge(before) || is_triangle_edge(after)) {
            const uint32_t k = std::max(before, after) - kTriangleEdge, other = std::min(before, after);
            const auto [low, high] = std::minmax(t[(k + 1) % 3], t[(k + 2) % 3]);
            edge_names_.push_back({low, high, std::min(part.cell, other), std::max(part.cell, other), corner});
        } else {
            // Seen from outside, `after` follows `before` around `cell`: (s_before - s_cell) x (s_after - s_cell)
            // points outward.
            TriangleName n{{part.cell, before, after}, corner, false};
            n.leaves = sort_is_even(n.sites);
            triangle_names_.push_back(n);
        }
    }

    void number_in_triangle(uint32_t triangle) {
        std::sort(triangle_names_.begin(), triangle_names_.end(), [](const TriangleName& x, const TriangleName& y) {
            return std::tie(x.sites, x.corner) < std::tie(y.sites, y.corner);
        });
        for (size_t i = 0, j; i < triangle_names_.size(); i = j) {
            const TriangleName& n = triangle_names_[i];
            for (j = i; j < triangle_names_.size() && triangle_names_[j].sites == n.sites; ++j) {
                out.is_whole &= triangle_names_[j].leaves == n.leaves;
                in_triangle_.emplace_back(triangle_names_[j].corner, static_cast<uint32_t>(out.in_triangles.size()));
            }
            out.is_whole &= j - i == 3;  // once in each of the three cells
            Corners corners;
            for (int m = 0; m < 3; ++m) corners[m] = mesh_.positions[mesh_.triangles[triangle][m]];
            const std::array<Vec3, 3> sites = {sites_[n.sites[0]], sites_[n.sites[1]], sites_[n.sites[2]]};
            out.in_triangles.push_back({triangle, n.sites, equidistant_weights(corners, sites, count_), n.leaves});
        }
        triangle_names_.clear();
    }

    void number_on_edges() {
        std::sort(edge_names_.begin(), edge_names_.end(), [](const EdgeName& x, const EdgeName& y) {
            return std::tuple(x.key(), x.corner) < std::tuple(y.key(), y.corner);
        });
        for (size_t i = 0, j; i < edge_names_.size(); i = j) {
            const EdgeName& n = edge_names_[i];
            for (j = i; j < edge_names_.size() && edge_names_[j].key() == n.key(); ++j)
                out.corner[edge_names_[j].corner] = out.n_mesh + static_cast<uint32_t>(out.on_edges.size());
            out.is_whole &= j - i == 4;  // in two cells of two triangles
            const double share =
                bisector_share(mesh_.positions[n.low], mesh_.positions[n.high], sites_[n.i], sites_[n.j], count_);
            out.on_edges.push_back({n.low, n.high, n.i, n.j, share});
        }
    }

    MeshView mesh_;
    std::span<const Vec3> sites_;
    const ClippedSurface& surface_;
    PredicateCount& count_;
    std::vector<EdgeName> edge_names_;
    std::vector<TriangleName> triangle_names_;                // of the triangle at hand
    std::vector<std::pair<uint32_t, uint32_t>> in_triangle_;  // corner, entry of out.in_triangles
};

}  // namespace

Vec3 SurfaceVertices::weights(const Triangle& triangle, uint32_t vertex) const {
    Vec3 w = Vec3::Zero();
    if (vertex < n_mesh) {
        for (int m = 0; m < 3; ++m) w[m] = triangle[m] == vertex;
    } else if (vertex < n_mesh + on_edges.size()) {
        const EdgeVertex& v = on_edges[vertex - n_mesh];
        for (int m = 0; m < 3; ++m) w[m] = triangle[m] == v.low ? 1 - v.share : triangle[m] == v.high ? v.share : 0;
    } else {
        w = in_triangles[vertex - n_mesh - on_edges.size()].weights;
    }
    return w;
}

std::vector<Vec3> SurfaceVertices::positions(MeshView mesh) const {
    std::vector<Vec3> p(mesh.positions.begin(), mesh.positions.end());
    p.reserve(size());
    // From one corner along edges: what lies in an axis-aligned plane stays in it, to the last bit.
    for (const EdgeVertex& v : on_edges)
        p.push_back(mesh.positions[v.low] + v.share * (mesh.positions[v.high] - mesh.positions[v.low]));
    for (const TriangleVertex& v : in_triangles) {
        const auto& [a, b, c] = mesh.triangles[v.triangle];
        p.push_back(mesh.positions[a] + v.weights[1] * (mesh.positions[b] - mesh.positions[a]) +
                    v.weights[2] * (mesh.positions[c] - mesh.positions[a]));
    }
    return p;
}

SurfaceVertices number_surface_vertices(MeshView mesh, std::span<const Vec3> sites, const ClippedSurface& surface,
                                        PredicateCount& io_count) {
    Numbering numbering(mesh, sites, surface, io_count);
    numbering.run();
    return std::move(numbering.out);
}

}  // namespace sunder
