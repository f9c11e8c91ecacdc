// When and on which side two convex solids touch first, the one moving straight past the other.
#pragma once

#include <algorithm>

#include "solver/collision/ellipsoid_distance.h"

namespace sunder {

inline constexpr double kSameNormal = 0.95;  // cosine from which a later touch tells nothing new

/// A separation found with solid a moved by `offset`, as it is before the move: same normal, gap along it.
inline Separation moved_back(Separation s, const Vec3& offset) {
    s.point_a -= offset;
    s.gap -= s.normal.dot(offset);
    return s;
}

/// Whether solid a, moved by `shift` relative to b along a straight line, comes within `reach` (> 0, m) of it on the
/// way; if so, `out_touch` has the normal of that moment with points and gap of the start, and `out_share` the share of
/// the way at which it happens.
///
/// `at(offset)` gives the separation with a moved by `offset`, its gap a lower bound of the true one. The plane of
/// normal n separates the solids as long as gap + offset . n > 0, so they may be advanced until that bound is half the
/// reach and measured anew; a plane that keeps them apart to the end of the way proves that they miss.
template <class SeparationAt>
bool first_touch(const SeparationAt& at, const Vec3& shift, double reach, Separation& out_touch, double& out_share) {
    constexpr int kMostAdvances = 32;  // grazing paths converge slowly; past it, the last plane is kept: safe
    double t = 0;
    for (int k = 0;; ++k) {
        const Separation s = at(Vec3(t * shift));
        const double approach = -s.normal.dot(shift);
        const bool near = s.gap <= reach;
        if (!near && approach * (1 - t) < s.gap - reach) return false;
        if (near || k == kMostAdvances) {
            out_touch = moved_back(s, t * shift);
            out_share = t;
            return true;
        }
        t = std::min(1.0, t + (s.gap - 0.5 * reach) / approach);
    }
}

}  // namespace sunder
