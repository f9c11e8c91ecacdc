#include "solver/data/rotations.h"

#include <algorithm>
#include <cmath>

#include "solver/data/math_functions.h"

namespace sunder {

Quat rotation_about(const Vec3& unit_axis, double angle) {
    const auto [sine, cosine] = math::sincos(0.5 * angle);
    return Quat(cosine, sine * unit_axis.x(), sine * unit_axis.y(), sine * unit_axis.z());
}

double angle_between(const Quat& a, const Quat& b) {
    const Quat apart = a * b.conjugate();
    return 2 * math::atan2(apart.vec().norm(), std::abs(apart.w()));
}

Quat slerp(const Quat& from, double share, const Quat& to) {
    const double sign = from.dot(to) < 0 ? -1.0 : 1.0;
    const double chord = (sign * to.coeffs() - from.coeffs()).norm();
    double keep = 1 - share, take = share;
    if (chord > 1e-8) {  // below it the arc is straight within a rounding
        const double angle = 2 * math::asin(std::min(0.5 * chord, 1.0)), whole = math::sin(angle);
        keep = math::sin(keep * angle) / whole, take = math::sin(take * angle) / whole;
    }
    return Quat(keep * from.coeffs() + (sign * take) * to.coeffs());
}

}  // namespace sunder
