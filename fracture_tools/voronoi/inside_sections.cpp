#include "fracture_tools/voronoi/inside_sections.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace sunder {
namespace {

constexpr int kUnknown = std::numeric_limits<int>::min();

/// Where a Voronoi edge crosses the surface, in the order along it.
struct CrossedEdges {
    std::vector<uint32_t> offset;  // (n_edges + 1)
    std::vector<uint32_t> vertex;  // entry of SurfaceVertices::in_triangles
};

CrossedEdges sort_crossings(MeshView mesh, std::span<const Vec3> sites, const VoronoiDiagram& diagram,
                            const SurfaceVertices& surface, PredicateCount& io_count) {
    const auto& crossings = surface.in_triangles;
    CrossedEdges out;
    out.vertex.resize(crossings.size());
    std::iota(out.vertex.begin(), out.vertex.end(), 0u);
    std::sort(out.vertex.begin(), out.vertex.end(), [&](uint32_t x, uint32_t y) {
        return std::tie(crossings[x].sites, x) < std::tie(crossings[y].sites, y);
    });
    out.offset.assign(1, 0);
    for (const VoronoiEdge& edge : diagram.edges) {
        const uint32_t begin = out.offset.back();
        uint32_t end = begin;
        while (end < out.vertex.size() && crossings[out.vertex[end]].sites == edge.sites) ++end;
        out.offset.push_back(end);
        if (end - begin < 2) continue;
        const std::array<Vec3, 3> of = {sites[edge.sites[0]], sites[edge.sites[1]], sites[edge.sites[2]]};
        std::vector<std::pair<LineCrossing, uint32_t>> order;
        for (uint32_t s = begin; s < end; ++s) {
            Corners corners;
            for (int m = 0; m < 3; ++m)
                corners[m] = mesh.positions[mesh.triangles[crossings[out.vertex[s]].triangle][m]];
            order.emplace_back(cross_line(corners, of), out.vertex[s]);
        }
        std::sort(order.begin(), order.end(), [&](const auto& x, const auto& y) {
            if (x.second == y.second) return false;
            const int order = order_along_line(x.first, y.first, of, io_count);
            // Where solids touch, one ends and the next one begins in the same point.
            const bool x_leaves = crossings[x.second].leaves, y_leaves = crossings[y.second].leaves;
            return order != 0 ? order > 0 : x_leaves != y_leaves ? x_leaves : x.second < y.second;
        });
        for (uint32_t s = begin; s < end; ++s) out.vertex[s] = order[s - begin].second;
    }
    return out;
}

class Walk {
public:
    Walk(const VoronoiDiagram& diagram, const SurfaceVertices& surface, const CrossedEdges& crossed)
        : diagram_(diagram), surface_(surface), crossed_(crossed), depth_(diagram.vertices.size(), kUnknown) {}

    void run() {
        find_depths();
        std::vector<uint32_t> number(depth_.size());
        for (uint32_t v = 0; v < depth_.size(); ++v) {
            number[v] = surface_.size() + static_cast<uint32_t>(out.vertices.size());
            if (depth_[v] > 0) out.vertices.push_back(v);
            out.overlaps += depth_[v] != 0 && depth_[v] != 1;
        }
        for (uint32_t e = 0; e < diagram_.edges.size(); ++e) list_sections(e, number);
    }

    InsideSkeleton out;

private:
    int depth(uint32_t vertex) const { return vertex == VoronoiDiagram::kInfinity ? 0 : depth_[vertex]; }

    /// By how much the surface covers the end of an edge more often than its start.
    int gain(uint32_t e) const {
        int sum = 0;
        for (uint32_t s = crossed_.offset[e]; s < crossed_.offset[e + 1]; ++s)
            sum += surface_.in_triangles[crossed_.vertex[s]].leaves ? -1 : 1;
        return sum;
    }

    void find_depths() {
        std::vector<std::array<uint32_t, 4>> edges_at(depth_.size());
        std::vector<uint8_t> n_edges_at(depth_.size(), 0);
        std::vector<uint32_t> queue;
        for (uint32_t e = 0; e < diagram_.edges.size(); ++e) {
            const auto [from, to] = std::pair(diagram_.edges[e].from, diagram_.edges[e].to);
            for (uint32_t v : {from, to})
                if (v != VoronoiDiagram::kInfinity) edges_at[v][n_edges_at[v]++] = e;
            if (to == VoronoiDiagram::kInfinity) reach(from, -gain(e), queue);
            if (from == VoronoiDiagram::kInfinity) reach(to, gain(e), queue);
        }
        for (size_t k = 0; k < queue.size(); ++k)
            for (uint8_t m = 0; m < n_edges_at[queue[k]]; ++m) {
                const uint32_t e = edges_at[queue[k]][m];
                if (diagram_.edges[e].from == queue[k])
                    reach(diagram_.edges[e].to, depth_[queue[k]] + gain(e), queue);
                else
                    reach(diagram_.edges[e].from, depth_[queue[k]] - gain(e), queue);
            }
    }

    void reach(uint32_t vertex, int depth, std::vector<uint32_t>& io_queue) {
        if (vertex == VoronoiDiagram::kInfinity) {
            out.mismatches += depth != 0;
        } else if (depth_[vertex] == kUnknown) {
            depth_[vertex] = depth;
            io_queue.push_back(vertex);
        } else {
            out.mismatches += depth_[vertex] != depth;
        }
    }

    /// Entries and exits pair up as brackets do; where the surface crosses itself they may be nested.
    void list_sections(uint32_t e, const std::vector<uint32_t>& number) {
        const VoronoiEdge& edge = diagram_.edges[e];
        std::vector<uint32_t>& open = open_;
        open.clear();
        if (depth(edge.from) > 0) open.push_back(number[edge.from]);
        auto close = [&](uint32_t to) {
            if (open.empty()) {
                ++out.mismatches;
                return;
            }
            out.sections.push_back({e, open.back(), to});
            open.pop_back();
        };
        for (uint32_t s = crossed_.offset[e]; s < crossed_.offset[e + 1]; ++s) {
            const uint32_t vertex =
                surface_.n_mesh + static_cast<uint32_t>(surface_.on_edges.size()) + crossed_.vertex[s];
            if (surface_.in_triangles[crossed_.vertex[s]].leaves)
                close(vertex);
            else
                open.push_back(vertex);
        }
        if (depth(edge.to) > 0) close(number[edge.to]);
        out.mismatches += open.size();
    }

    const VoronoiDiagram& diagram_;
    const SurfaceVertices& surface_;
    const CrossedEdges& crossed_;
    std::vector<int> depth_;  // how often the solid covers a Voronoi vertex
    std::vector<uint32_t> open_;
};

}  // namespace

InsideSkeleton find_inside_sections(MeshView mesh, std::span<const Vec3> sites, const VoronoiDiagram& diagram,
                                    const SurfaceVertices& surface, PredicateCount& io_count) {
    const CrossedEdges crossed = sort_crossings(mesh, sites, diagram, surface, io_count);
    Walk walk(diagram, surface, crossed);
    walk.run();
    if (crossed.offset.back() != crossed.vertex.size()) ++walk.out.mismatches;  // crossings of lines that are no edge
    return std::move(walk.out);
}

}  // namespace sunder
