// Random solids and oracles for the collision tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "solver/collision/shape_distance.h"

namespace sunder {

inline std::mt19937_64 generator(uint64_t seed) { return std::mt19937_64(seed); }

/// Uniform in [lo, hi) from the raw bits: std distributions differ between libraries.
inline double uniform(std::mt19937_64& rng, double lo, double hi) {
    return lo + (hi - lo) * double(rng() >> 11) * 0x1p-53;
}

inline Vec3 uniform3(std::mt19937_64& rng, double lo, double hi) {
    const double x = uniform(rng, lo, hi), y = uniform(rng, lo, hi), z = uniform(rng, lo, hi);
    return {x, y, z};
}

inline Mat3 random_axes(std::mt19937_64& rng) {
    Quat q;
    do q.coeffs() << uniform3(rng, -1, 1), uniform(rng, -1, 1);
    while (q.norm() < 0.1);
    return q.normalized().toRotationMatrix();
}

inline Ellipsoid random_ellipsoid(std::mt19937_64& rng, double spread, double aspect) {
    Ellipsoid e;
    e.center = uniform3(rng, -spread, spread);
    e.axes = random_axes(rng);
    for (int i = 0; i < 3; ++i) e.radii[i] = std::exp(uniform(rng, 0, std::log(aspect))) / std::sqrt(aspect);
    return e;
}

/// Ellipsoids as a solver keeps them.
struct EllipsoidArrays {
    /// Valid until the next call.
    ParticleEllipsoids of(const std::vector<Ellipsoid>& ellipsoids) {
        center.clear(), turn.clear(), radii.clear();
        for (const Ellipsoid& e : ellipsoids)
            center.push_back(e.center), turn.push_back(Quat(e.axes)), radii.push_back(e.radii);
        unturned.assign(center.size(), Quat::Identity());
        return {center, turn, unturned, radii};
    }
    std::vector<Vec3> center, radii;
    std::vector<Quat> turn, unturned;
};

inline Pose random_pose(std::mt19937_64& rng, double spread) {
    return {uniform3(rng, -spread, spread), Quat(random_axes(rng))};
}

inline Vec3 random_direction(std::mt19937_64& rng) { return random_axes(rng).col(0); }

inline double support(const Ellipsoid& e, const Vec3& n) {
    return (e.radii.asDiagonal() * (e.axes.transpose() * n)).norm();
}

/// Support of a sphere, box or capsule about its own position.
inline double support(const PlacedShape& s, const Vec3& n) {
    const Vec3 local = s.pose.orientation.conjugate() * n;
    switch (s.shape.kind) {
        case ShapeKind::sphere:
            return s.shape.radius;
        case ShapeKind::box:
            return s.shape.half_extents.dot(local.cwiseAbs());
        default:
            return s.shape.radius + s.shape.half_height * std::abs(local.z());
    }
}

inline Shape sphere(double radius) {
    Shape s;
    s.kind = ShapeKind::sphere;
    s.radius = radius;
    return s;
}
inline Shape box(const Vec3& half) {
    Shape s;
    s.kind = ShapeKind::box;
    s.half_extents = half;
    return s;
}
inline Shape plane() {
    Shape s;
    s.kind = ShapeKind::plane;
    return s;
}
inline Shape capsule(double radius, double half_height) {
    Shape s;
    s.kind = ShapeKind::capsule;
    s.radius = radius;
    s.half_height = half_height;
    return s;
}

/// The best of 3000 directions of a spiral, each of the five best then refined by shrinking steps on the sphere.
template <class Bound>
double brute_force_maximum(const Bound& bound) {
    constexpr int kDirections = 3000;
    std::vector<std::pair<double, Vec3>> samples;
    for (int k = 0; k < kDirections; ++k) {
        const double z = 1 - (2 * k + 1.0) / kDirections, phi = k * 2.399963229728653, r = std::sqrt(1 - z * z);
        const Vec3 n(r * std::cos(phi), r * std::sin(phi), z);
        samples.push_back({bound(n), n});
    }
    std::partial_sort(samples.begin(), samples.begin() + 5, samples.end(),
                      [](const auto& x, const auto& y) { return x.first > y.first; });
    double best = -1e300;
    for (int s = 0; s < 5; ++s) {
        auto [f, n] = samples[s];
        for (double step = 0.1; step > 1e-6;) {
            const Vec3 t1 = n.unitOrthogonal(), t2 = n.cross(t1);
            bool rose = false;
            for (int k = 0; k < 8 && !rose; ++k) {
                const Vec3 m = (n + step * (std::cos(k * M_PI / 4) * t1 + std::sin(k * M_PI / 4) * t2)).normalized();
                const double g = bound(m);
                if (g > f) {
                    f = g;
                    n = m;
                    rose = true;
                }
            }
            if (!rose) step *= 0.5;
        }
        best = std::max(best, f);
    }
    return best;
}

inline void expect_whole(const Separation& s, double size) {
    EXPECT_NEAR(s.normal.norm(), 1, 1e-12);
    EXPECT_NEAR(s.normal.dot(s.point_a - s.point_b), s.gap, 1e-12 * size);  // rounding of one dot product
    EXPECT_TRUE(s.point_a.allFinite() && s.point_b.allFinite() && std::isfinite(s.gap));
}

}  // namespace sunder
