#include "fracture_tools/repair/repair_seams.h"

#include <algorithm>
#include <cmath>

#include "fracture_tools/mesh/point_grid.h"
#include "fracture_tools/repair/repair_attributes.h"
#include "solver/data/ids.h"

namespace sunder {
namespace {

/// Edges run side by side when their ends are nearer than this share of their lengths, and their directions, one of
/// them turned round, are this near. Triangles are folded onto one another when they go off to the same side so nearly.
constexpr double kNear = 0.1, kSameWay = 0.9;
/// Distances of one kind grow by less than this from one to the next.
constexpr double kLeap = 4;
/// A vertex is beside the end of an edge, not on the edge, when that is not so many times farther.
constexpr double kAlong = 4;

/// Vertices of borders, looked up near edges.
class BorderVertices {
public:
    BorderVertices(const MeshView& mesh, std::span<const OpenEdge> open)
        : mesh_(mesh), vertex_(vertices_of(open)), grid_(places_of(mesh, vertex_)) {}

    /// Calls visit(vertex, share along the edge, distance) for those within `reach` (m) of an edge that are none of its
    /// triangle's corners.
    template <class Visit>
    void visit_beside(const OpenEdge& edge, double reach, Visit visit) const {
        const Vec3 &a = mesh_.positions[edge.from], &b = mesh_.positions[edge.to];
        const Vec3 along = b - a;
        const Triangle& corners = mesh_.triangles[edge.corner / 3];
        grid_.visit_near(0.5 * (a + b), 0.5 * along.norm() + reach, [&](uint32_t k) {
            const Vec3& p = mesh_.positions[vertex_[k]];
            const double share = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
            const double distance = (p - a - share * along).norm();
            if (distance > reach) return;
            if (std::ranges::none_of(corners, [&](uint32_t v) { return mesh_.positions[v] == p; }))
                visit(vertex_[k], share, distance);
        });
    }

private:
    static std::vector<uint32_t> vertices_of(std::span<const OpenEdge> open) {
        std::vector<uint32_t> vertices;
        for (const OpenEdge& e : open) vertices.insert(vertices.end(), {e.from, e.to});
        std::sort(vertices.begin(), vertices.end());
        vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
        return vertices;
    }
    static std::vector<Vec3> places_of(const MeshView& mesh, const std::vector<uint32_t>& vertices) {
        std::vector<Vec3> places;
        for (uint32_t v : vertices) places.push_back(mesh.positions[v]);
        return places;
    }

    MeshView mesh_;
    std::vector<uint32_t> vertex_;  // ascending
    PointGrid grid_;
};

/// An open edge as its neighbours see it.
struct SeamSide {
    double length;                                       // m
    Vec3 direction, inward;                              // unit; along it, and from it into its triangle
    std::array<double, 2> apart = {HUGE_VAL, HUGE_VAL};  // of its ends from the nearest edge beside it, m
};

SeamSide side_of(const MeshView& mesh, const OpenEdge& edge) {
    const Vec3& a = mesh.positions[edge.from];
    const Vec3 along = mesh.positions[edge.to] - a;
    const Vec3 direction = along.normalized();
    const Vec3 to_third = mesh.positions[mesh.triangles[edge.corner / 3][(edge.corner + 2) % 3]] - a;
    return {along.norm(), direction, (to_third - to_third.dot(direction) * direction).normalized()};
}

/// A vertex on an edge of a triangle.
struct OnEdge {
    uint32_t triangle, side, vertex;  // the side from corner `side` to the next one
    double share;                     // of the way along it
    Vec3 place;
};

/// Fans of the triangle's third corner over each side in turn, whose last triangle has the next side.
std::vector<std::array<WeightedCorner, 3>> cut_triangle(const Triangle& corners, std::span<const OnEdge> on_edges) {
    std::vector<std::array<WeightedCorner, 3>> parts = {
        {WeightedCorner{corners[0], Vec3::UnitX()}, {corners[1], Vec3::UnitY()}, {corners[2], Vec3::UnitZ()}}};
    for (size_t begin = 0, end; begin < on_edges.size(); begin = end) {
        const uint32_t side = on_edges[begin].side, from = corners[side], to = corners[(side + 1) % 3];
        for (end = begin; end < on_edges.size() && on_edges[end].side == side;) ++end;
        size_t t = 0;
        int c = 0;
        while (parts[t][c].vertex != from || parts[t][(c + 1) % 3].vertex != to)
            if (++c == 3) c = 0, ++t;
        const WeightedCorner third = parts[t][(c + 2) % 3], last = parts[t][(c + 1) % 3];
        WeightedCorner before = parts[t][c];
        for (size_t k = begin; k <= end; ++k) {
            WeightedCorner next = last;
            if (k < end) {
                next = {on_edges[k].vertex, Vec3::Zero()};
                next.weights[side] = 1 - on_edges[k].share, next.weights[(side + 1) % 3] = on_edges[k].share;
            }
            if (k == begin)
                parts[t] = {before, next, third};
            else
                parts.push_back({before, next, third});
            before = next;
        }
    }
    return parts;
}

}  // namespace

double seam_gap(const MeshView& mesh, std::span<const OpenEdge> open, double least, double largest) {
    std::vector<SeamSide> sides;
    std::vector<std::array<uint32_t, 2>> at(mesh.positions.size(), {kNone, kNone});  // edges that leave, that arrive
    for (uint32_t k = 0; k < open.size(); ++k) {
        sides.push_back(side_of(mesh, open[k]));
        at[open[k].from][0] = at[open[k].to][1] = k;
    }
    const BorderVertices border(mesh, open);
    for (uint32_t k = 0; k < open.size(); ++k) {
        const SeamSide& own = sides[k];
        border.visit_beside(open[k], std::min(largest, kNear * own.length), [&](uint32_t v, double, double distance) {
            const Vec3& p = mesh.positions[v];
            const double to_end =
                std::min((p - mesh.positions[open[k].from]).norm(), (p - mesh.positions[open[k].to]).norm());
            const double apart = to_end < kAlong * distance ? to_end : distance;
            for (int end = 0; end < 2; ++end) {
                if (at[v][end] == kNone) continue;
                SeamSide& other = sides[at[v][end]];
                if (apart > kNear * std::min(own.length, other.length)) continue;
                if (own.direction.dot(other.direction) > -kSameWay || own.inward.dot(other.inward) > kSameWay) continue;
                other.apart[end] = std::min(other.apart[end], apart);
            }
        });
    }
    std::vector<double> gaps;
    for (const SeamSide& s : sides)
        if (const double gap = std::max(s.apart[0], s.apart[1]); gap > least && gap <= largest) gaps.push_back(gap);
    if (gaps.empty()) return 0;
    std::sort(gaps.begin(), gaps.end());
    size_t k = gaps.size() / 2;
    while (k + 1 < gaps.size() && gaps[k + 1] < kLeap * gaps[k]) ++k;
    return gaps[k];
}

SplitEdges split_open_edges(TriMesh& io_mesh, std::span<const OpenEdge> open, double tolerance) {
    SplitEdges out;
    std::vector<OnEdge> found;
    {
        const BorderVertices border(io_mesh, open);
        for (const OpenEdge& edge : open)
            border.visit_beside(edge, tolerance, [&](uint32_t v, double share, double) {
                const bool is_between = (io_mesh.positions[v] - io_mesh.positions[edge.from]).norm() > tolerance &&
                                        (io_mesh.positions[v] - io_mesh.positions[edge.to]).norm() > tolerance;
                if (is_between) found.push_back({edge.corner / 3, edge.corner % 3, v, share, io_mesh.positions[v]});
            });
    }
    std::sort(found.begin(), found.end(), [](const OnEdge& x, const OnEdge& y) {
        return std::tuple(x.triangle, x.side, x.share, x.vertex) < std::tuple(y.triangle, y.side, y.share, y.vertex);
    });
    const auto twice = [](const OnEdge& x, const OnEdge& y) {  // the surface is parted there
        return x.triangle == y.triangle && x.side == y.side && x.place == y.place;
    };
    found.erase(std::unique(found.begin(), found.end(), twice), found.end());
    if (found.empty()) return out;
    out.first = found[0].place;
    for (size_t begin = 0, end; begin < found.size(); begin = end) {
        for (end = begin; end < found.size() && found[end].triangle == found[begin].triangle; ++end)
            out.n += end == begin || found[end].side != found[end - 1].side;
        const uint32_t t = found[begin].triangle;
        const auto parts = cut_triangle(io_mesh.triangles[t], std::span(found).subspan(begin, end - begin));
        replace_triangle(io_mesh, t, parts);
        out.source.insert(out.source.end(), parts.size() - 1, t);
    }
    return out;
}

}  // namespace sunder
