#include "solver/collision/ellipsoid_distance.h"

#include <array>

#include "solver/collision/support_ascent.h"

namespace sunder {
namespace {

/// Numbers compared in stored order: centres decide, unless they coincide.
bool precedes(const Ellipsoid& a, const Ellipsoid& b) {
    for (int i = 0; i < 3; ++i)
        if (a.center[i] != b.center[i]) return a.center[i] < b.center[i];
    for (int i = 0; i < 3; ++i)
        if (a.radii[i] != b.radii[i]) return a.radii[i] < b.radii[i];
    for (int i = 0; i < 9; ++i)
        if (a.axes.data()[i] != b.axes.data()[i]) return a.axes.data()[i] < b.axes.data()[i];
    return true;
}

Separation ordered_distance(const Ellipsoid& a, const Ellipsoid& b, const Vec3& start) {
    detail::SupportGap<true, false> gap;
    gap.d = a.center - b.center;
    gap.M_a = detail::support_matrix(a.axes, a.radii);
    gap.M_b = detail::support_matrix(b.axes, b.radii);
    const std::array<Vec3, 6> axes = {a.axes.col(0), a.axes.col(1), a.axes.col(2),
                                      b.axes.col(0), b.axes.col(1), b.axes.col(2)};
    const auto best = detail::best_direction(gap, start, axes);
    Separation s;
    s.normal = best.n;
    s.point_a = a.center - best.s_a;
    s.point_b = b.center + best.s_b;
    s.gap = best.f;
    return s;
}

}  // namespace

Separation ellipsoid_distance(const Ellipsoid& a, const Ellipsoid& b, const Vec3& warm_start) {
    return precedes(a, b) ? ordered_distance(a, b, warm_start) : flipped(ordered_distance(b, a, -warm_start));
}

Separation ellipsoid_distance(const Ellipsoid& a, const Ellipsoid& b) {
    return ellipsoid_distance(a, b, a.center - b.center);
}

}  // namespace sunder
