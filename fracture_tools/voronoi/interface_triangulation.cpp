#include "fracture_tools/voronoi/interface_triangulation.h"

#include <algorithm>
#include <optional>

#include "fracture_tools/mesh/outline_triangulation.h"

namespace sunder {
namespace {

using Loops = std::span<const std::span<const uint32_t>>;

/// A vertex that lies where the one before it in its loop lies, in the plane's doubles: left out, put back afterwards.
struct Repeated {
    uint32_t vertex, before, after;
};

std::vector<uint32_t> leave_out_repeated(std::span<const Vec3> points, std::span<const uint32_t> loop,
                                         const PlaneProjection& project, std::vector<Repeated>& io_repeated) {
    std::vector<uint32_t> kept;
    for (size_t k = 0; k < loop.size(); ++k) {
        const uint32_t next = loop[(k + 1) % loop.size()];
        const bool repeats = !kept.empty() && project(points[loop[k]]) == project(points[kept.back()]);
        const bool closes =
            k + 1 == loop.size() && !kept.empty() && project(points[loop[k]]) == project(points[kept[0]]);
        if (repeats || closes)
            io_repeated.push_back({loop[k], kept.back(), next});
        else
            kept.push_back(loop[k]);
    }
    return kept;
}

/// Puts vertices back into the side of the triangle that they were left out of.
bool put_back(const std::vector<Repeated>& repeated, std::vector<Triangle>& io_triangles) {
    for (auto r = repeated.rbegin(); r != repeated.rend(); ++r) {
        bool done = false;
        for (size_t t = 0; t < io_triangles.size() && !done; ++t)
            for (int c = 0; c < 3 && !done; ++c) {
                if (io_triangles[t][c] != r->before || io_triangles[t][(c + 1) % 3] != r->after) continue;
                Triangle added = io_triangles[t];
                added[c] = r->vertex;
                io_triangles[t][(c + 1) % 3] = r->vertex;
                io_triangles.push_back(added);
                done = true;
            }
        if (!done) return false;
    }
    return true;
}

/// Nothing where the outline is not simple in the plane's doubles.
std::optional<std::vector<Triangle>> triangulate(std::span<const Vec3> points, Loops loops, const Vec3& normal) {
    const PlaneProjection project(normal);
    std::vector<Repeated> repeated;
    std::vector<std::vector<uint32_t>> kept;
    for (const auto& loop : loops) {
        kept.push_back(leave_out_repeated(points, loop, project, repeated));
        if (kept.back().size() < 3) return std::nullopt;
    }
    const std::vector<std::span<const uint32_t>> views(kept.begin(), kept.end());
    std::optional<std::vector<Triangle>> triangles = triangulate_outline(points, views, project);
    if (!triangles) return std::nullopt;
    std::vector<uint32_t> vertex;  // of each corner
    for (const auto& loop : kept) vertex.insert(vertex.end(), loop.begin(), loop.end());
    for (Triangle& t : *triangles) {
        for (uint32_t& corner : t) corner = vertex[corner];
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    }
    std::sort(triangles->begin(), triangles->end());  // CGAL's order goes by addresses
    if (!put_back(repeated, *triangles)) return std::nullopt;
    return triangles;
}

/// Each side of the loops is a side of one triangle, in its direction; all others come in both directions.
bool has_border(const std::vector<Triangle>& triangles, Loops loops) {
    std::vector<std::array<uint32_t, 2>> sides;
    for (const Triangle& t : triangles)
        for (int c = 0; c < 3; ++c) sides.push_back({t[c], t[(c + 1) % 3]});
    for (const auto& loop : loops)  // the other side of the border
        for (size_t k = 0; k < loop.size(); ++k) sides.push_back({loop[(k + 1) % loop.size()], loop[k]});
    std::vector<std::array<uint32_t, 2>> opposite;
    for (const auto& [from, to] : sides) opposite.push_back({to, from});
    std::sort(sides.begin(), sides.end());
    std::sort(opposite.begin(), opposite.end());
    return sides == opposite && std::adjacent_find(sides.begin(), sides.end()) == sides.end();
}

/// Cuts off one ear after the other: of those that turn the right way and hold no other vertex the smallest, or else
/// the smallest of all. Closed whatever the loop is like. Around a hole, which is clockwise, triangles are turned over:
/// they take away what the loop around it has too much.
void clip_ears(std::span<const Vec3> points, std::span<const uint32_t> loop, const Vec3& normal,
               std::vector<Triangle>& out) {
    const PlaneProjection project(normal);
    auto area = [&](uint32_t a, uint32_t b, uint32_t c) {  // twice, counter-clockwise above 0
        const auto p = project(points[a]), q = project(points[b]), r = project(points[c]);
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    };
    std::vector<uint32_t> left(loop.begin(), loop.end());
    double all = 0;
    for (size_t k = 2; k < left.size(); ++k) all += area(left[0], left[k - 1], left[k]);
    const double turn = all < 0 ? -1 : 1;
    while (left.size() > 2) {
        const size_t n = left.size();
        size_t best = 0;
        std::pair<bool, double> least = {true, HUGE_VAL};  // is no ear, area
        for (size_t k = 0; k < n; ++k) {
            const uint32_t a = left[(k + n - 1) % n], b = left[k], c = left[(k + 1) % n];
            const double own = turn * area(a, b, c);
            bool is_none = own < 0;
            for (size_t m = 0; m < n && !is_none; ++m)
                is_none = left[m] != a && left[m] != b && left[m] != c && turn * area(a, b, left[m]) > 0 &&
                          turn * area(b, c, left[m]) > 0 && turn * area(c, a, left[m]) > 0;
            if (const std::pair found(is_none, std::abs(own)); found < least) least = found, best = k;
        }
        out.push_back({left[(best + n - 1) % n], left[best], left[(best + 1) % n]});
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
    }
}

}  // namespace

FilledOutline fill_outline(std::span<const Vec3> points, Loops loops, const Vec3& normal) {
    FilledOutline out;
    if (loops.size() == 1 && loops[0].size() == 3) {
        out.triangles.push_back({loops[0][0], loops[0][1], loops[0][2]});
        return out;
    }
    if (auto triangles = triangulate(points, loops, normal); triangles && has_border(*triangles, loops)) {
        out.triangles = std::move(*triangles);
        return out;
    }
    for (const auto& loop : loops) {
        auto alone = triangulate(points, {&loop, 1}, normal);
        if (alone && has_border(*alone, {&loop, 1})) {
            out.triangles.insert(out.triangles.end(), alone->begin(), alone->end());
            continue;
        }
        out.may_overlap = true;
        clip_ears(points, loop, normal, out.triangles);
    }
    return out;
}

}  // namespace sunder
