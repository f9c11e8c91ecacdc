// The only file that includes CGAL's intersections of triangles and boxes.
#include "fracture_tools/mesh/self_intersections.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>

#include <algorithm>

namespace sunder {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, uint32_t>;

Kernel::Point_3 point(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

/// Corners of `t` so that those which `other` has come first; their number.
int shared_first(Triangle& io_t, const Triangle& other) {
    int n = 0;
    for (int c = 0; c < 3; ++c)
        if (std::find(other.begin(), other.end(), io_t[c]) != other.end()) std::swap(io_t[c], io_t[n++]);
    return n;
}

bool meet(std::span<const Vec3> points, Triangle s, Triangle t) {
    const int shared = shared_first(s, t);
    shared_first(t, s);
    const Kernel::Point_3 s0 = point(points[s[0]]), s1 = point(points[s[1]]), s2 = point(points[s[2]]);
    const Kernel::Point_3 t0 = point(points[t[0]]), t1 = point(points[t[1]]), t2 = point(points[t[2]]);
    if (shared == 3) return true;
    if (shared == 2)  // folded onto one another
        return CGAL::coplanar(s0, s1, s2, t2) && CGAL::coplanar_orientation(s0, s1, s2, t2) == CGAL::POSITIVE;
    const Kernel::Triangle_3 first(s0, s1, s2), second(t0, t1, t2);
    if (shared == 1)
        return CGAL::do_intersect(first, Kernel::Segment_3(t1, t2)) ||
               CGAL::do_intersect(second, Kernel::Segment_3(s1, s2));
    return CGAL::do_intersect(first, second);
}

}  // namespace

std::vector<std::pair<uint32_t, uint32_t>> self_intersections(std::span<const Vec3> points,
                                                              std::span<const Triangle> triangles) {
    std::vector<Box> boxes;
    for (uint32_t t = 0; t < triangles.size(); ++t) {
        const auto& [a, b, c] = triangles[t];
        const Kernel::Point_3 p = point(points[a]), q = point(points[b]), r = point(points[c]);
        if (CGAL::collinear(p, q, r)) continue;
        boxes.emplace_back(p.bbox() + q.bbox() + r.bbox(), t);
    }
    std::vector<std::pair<uint32_t, uint32_t>> pairs;
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& x, const Box& y) {
        const uint32_t low = std::min(x.info(), y.info()), high = std::max(x.info(), y.info());
        if (meet(points, triangles[low], triangles[high])) pairs.emplace_back(low, high);
    });
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

}  // namespace sunder
