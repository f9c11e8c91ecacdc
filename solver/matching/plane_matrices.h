// Functions of symmetric 2x2 matrices.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace sunder {

using Mat2 = Eigen::Matrix2d;

/// f of a symmetric matrix.
template <class F>
Mat2 function_of(const Mat2& m, const F& f) {
    // Closed form: eigenvalues mean +- radius.
    const double mean = 0.5 * m.trace(), half = 0.5 * (m(0, 0) - m(1, 1)), off = m(0, 1);
    const double radius = std::sqrt(half * half + off * off);
    if (radius == 0) return f(mean) * Mat2::Identity();
    Mat2 direction;  // of the larger eigenvalue minus that of the smaller
    direction << half / radius, off / radius, off / radius, -half / radius;
    const double high = f(mean + radius), low = f(mean - radius);
    return 0.5 * (high + low) * Mat2::Identity() + 0.5 * (high - low) * direction;
}

/// Eigenvalues of a symmetric matrix and the direction of the larger one, a unit vector.
struct PlaneEigen {
    double high, low;
    Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  // of all where they are equal

    explicit PlaneEigen(const Mat2& m) {
        const double mean = 0.5 * m.trace(), half = 0.5 * (m(0, 0) - m(1, 1)), off = m(0, 1);
        const double radius = std::sqrt(half * half + off * off);
        high = mean + radius, low = mean - radius;
        if (radius > 0)
            direction =
                (half > 0 ? Eigen::Vector2d(radius + half, off) : Eigen::Vector2d(off, radius - half)).normalized();
    }
};

}  // namespace sunder
