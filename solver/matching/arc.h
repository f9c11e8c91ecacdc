// Small rotations: where an arc leads, and how rotation vectors change.
#pragma once

#include <cmath>
#include <numbers>

#include "solver/data/math.h"
#include "solver/data/math_functions.h"
#include "solver/matching/bent_kernels.h"

namespace sunder {

inline Mat3 cross_matrix(const Vec3& a) {
    Mat3 m;
    m << 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0;
    return m;
}

/// Of rotations that K is the gradient of: how what is drawn along the other two axes changes across each, 1/m.
inline Vec3 across_gradient(const Mat3& K) { return {K(2, 1) - K(1, 2), K(0, 2) - K(2, 0), K(1, 0) - K(0, 1)}; }

/// Nothing presses across what is bent, so that its thickness changes as it is drawn: places by the squares of arms
/// times `by`, 1/m, whose slope by across_gradient is `rate`. What is crumpled, and has flowed, is not turned inside
/// out. `ratio`: nu / (1 - nu).
struct Thinned {
    Vec3 by, rate;

    Thinned(double ratio, const Vec3& extent, const Mat3& K) {
        const Vec3 drawn = across_gradient(K);
        for (int k = 0; k < 3; ++k) {
            const double strain = drawn[k] * extent[k] / kMostDrawn, left = 1 / std::sqrt(1 + strain * strain);
            by[k] = -0.5 * ratio * left * drawn[k], rate[k] = -0.5 * ratio * left * left * left;
        }
    }
};

/// A turn is known but for whole ones: beyond half of one it is taken to be the one that lies nearer to `expected`, up
/// to three quarters. What is folded for good turns no back flip as it comes to half a turn.
inline Vec3 continued(const Vec3& turn, const Vec3& expected) {
    const double t = turn.norm(), pi = std::numbers::pi;
    if (t < pi / 2) return turn;
    return turn.dot(expected) < t * (t - pi) ? Vec3((1 - 2 * pi / t) * turn) : turn;
}

/// J^-1 = 1 - [phi]x / 2 + (1/phi^2 - cot(phi/2) / (2 phi)) [phi]x^2: how a rotation vector changes by a turn.
inline Mat3 rotation_vector_rate(const Vec3& phi) {
    const double t2 = phi.squaredNorm();
    double c = 1.0 / 12 + t2 * (1.0 / 720 + t2 / 30240);
    if (t2 > 1e-2) {
        const double t = std::sqrt(t2);
        const math::SineAndCosine half = math::sincos(0.5 * t);
        c = 1 / t2 - half.cosine / (2 * t * half.sine);
    }
    const Mat3 w = cross_matrix(phi);
    return Mat3::Identity() - 0.5 * w + c * w * w;
}

/// A line of rest vector q that turns evenly by phi on its way ends at q + place; `rate`: of place, by phi.
struct Arc {
    Vec3 place;
    Mat3 rate;

    Arc(const Vec3& phi, const Vec3& q) {
        // place = a phi x q + b phi x (phi x q), a = (1 - cos t) / t^2, b = (t - sin t) / t^3; da = a' / t, db = b' / t
        const double t2 = phi.squaredNorm();
        double a = 0.5 - t2 * (1.0 / 24 - t2 / 720), b = 1.0 / 6 - t2 * (1.0 / 120 - t2 / 5040);
        double da = -1.0 / 12 + t2 * (1.0 / 180 - t2 / 6720), db = -1.0 / 60 + t2 * (1.0 / 1260 - t2 / 60480);
        if (t2 > 1e-2) {
            const double t = std::sqrt(t2);
            const math::SineAndCosine of = math::sincos(t);
            a = (1 - of.cosine) / t2, b = (t - of.sine) / (t2 * t);
            da = (of.sine / t - 2 * a) / t2, db = (a - 3 * b) / t2;
        }
        const Vec3 across = phi.cross(q), back = phi.cross(across);
        place = a * across + b * back;
        rate = (da * across + db * back) * phi.transpose() - a * cross_matrix(q) -
               b * (cross_matrix(across) + cross_matrix(phi) * cross_matrix(q));
    }
};

}  // namespace sunder
