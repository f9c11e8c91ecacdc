#include "fracture_tools/voronoi/interface_loops.h"

#include <algorithm>
#include <tuple>

namespace sunder {
namespace {

/// A directed side of an interface, as cell a sees it from outside: counter-clockwise around its inside.
struct Side {
    uint32_t a, b, from, to;
};

bool before(const Side& x, const Side& y) { return std::tie(x.a, x.b, x.from) < std::tie(y.a, y.b, y.from); }

std::vector<Side> list_sides(const VoronoiDiagram& diagram, const ClippedSurface& surface,
                             const SurfaceVertices& vertices, const InsideSkeleton& skeleton) {
    std::vector<Side> sides;
    for (const SurfacePolygon& part : surface.polygons)
        for (uint32_t c = part.begin; c < part.end; ++c) {
            const LineLabel other = surface.side[c];
            if (is_triangle_edge(other) || other < part.cell) continue;
            // The polygon goes one way along the bisector, the interface at its side the other way.
            const uint32_t from = vertices.corner[c], to = vertices.corner[c + 1 == part.end ? part.begin : c + 1];
            sides.push_back({part.cell, other, to, from});
        }
    // Around the face between i and j, outward from i, the edge with k goes along (s_j - s_i) x (s_k - s_i).
    for (const InsideSection& s : skeleton.sections) {
        const auto& [i, j, k] = diagram.edges[s.edge].sites;
        sides.push_back({i, j, s.from, s.to});
        sides.push_back({i, k, s.to, s.from});
        sides.push_back({j, k, s.from, s.to});
    }
    std::sort(sides.begin(), sides.end(), before);
    return sides;
}

}  // namespace

InterfaceOutlines chain_interface_loops(const VoronoiDiagram& diagram, const ClippedSurface& surface,
                                        const SurfaceVertices& vertices, const InsideSkeleton& skeleton) {
    const std::vector<Side> sides = list_sides(diagram, surface, vertices, skeleton);
    std::vector<uint8_t> is_used(sides.size(), 0);
    InterfaceOutlines out;
    out.loop_offset.push_back(0);
    for (size_t begin = 0, end; begin < sides.size(); begin = end) {
        for (end = begin; end < sides.size() && sides[end].a == sides[begin].a && sides[end].b == sides[begin].b;) {
            if (end > begin) out.broken += sides[end].from == sides[end - 1].from;
            ++end;
        }
        const auto first_loop = static_cast<uint32_t>(out.loop_offset.size() - 1);
        for (size_t start = begin; start < end; ++start) {
            if (is_used[start]) continue;
            for (size_t s = start; !is_used[s];) {
                is_used[s] = 1;
                out.vertex.push_back(sides[s].from);
                const Side next{sides[s].a, sides[s].b, sides[s].to, 0};
                const auto found = std::lower_bound(sides.begin() + begin, sides.begin() + end, next, before);
                if (found == sides.begin() + end || found->from != next.from) {
                    ++out.broken;
                    break;
                }
                s = static_cast<size_t>(found - sides.begin());
                if (is_used[s]) out.broken += s != start;
            }
            out.loop_offset.push_back(static_cast<uint32_t>(out.vertex.size()));
        }
        out.interfaces.push_back(
            {sides[begin].a, sides[begin].b, first_loop, static_cast<uint32_t>(out.loop_offset.size() - 1)});
    }
    return out;
}

}  // namespace sunder
