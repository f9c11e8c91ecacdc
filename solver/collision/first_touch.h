// When and on which side two convex solids touch first, the one moving straight past the other.
#pragma once

#include <algorithm>

#include "solver/collision/ellipsoid_distance.h"

namespace sunder {

/// A separation found with solid a moved by `offset`, as it is before the move: same normal, gap along it.
inline Separation moved_back(Separation s, const Vec3& offset) {
    s.point_a -= offset;
    s.gap -= s.normal.dot(offset);
    return s;
}

/// Whether solid a, moving at `velocity` relative to b, comes within `reach` (> 0, m) of it in [0, duration]; if so,
/// `out_touch` has the normal of that moment with points and gap of the start, and `out_time` the moment.
///
/// `at(offset)` gives the separation with a moved by `offset`, its gap a lower bound of the true one. The plane of
/// normal n separates the solids as long as gap + t n.v > 0, so they may be advanced until that bound is half the reach
/// and measured anew; a plane that keeps them apart through the end of the step proves that they miss.
template <class SeparationAt>
bool first_touch(const SeparationAt& at, const Vec3& velocity, double duration, double reach, Separation& out_touch,
                 double* out_time = nullptr) {
    constexpr int kMostAdvances = 32;           // grazing paths converge slowly; past it, the last plane is kept: safe
    double t = 0;
    for (int k = 0;; ++k) {
        const Separation s = at(Vec3(t * velocity));
        const double approach = -s.normal.dot(velocity);
        const bool near = s.gap <= reach;
        if (!near && approach * (duration - t) < s.gap - reach) return false;
        if (near || k == kMostAdvances) {
            out_touch = moved_back(s, t * velocity);
            if (out_time) *out_time = t;
            return true;
        }
        t = std::min(duration, t + (s.gap - 0.5 * reach) / approach);
    }
}

}  // namespace sunder
