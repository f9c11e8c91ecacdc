// Distance of ellipsoids against a brute-force search over all directions.
#include "solver/collision/ellipsoid_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace sunder {
namespace {

std::mt19937_64 generator(uint64_t seed) { return std::mt19937_64(seed); }

/// Uniform in [lo, hi) from the raw bits: std distributions differ between libraries.
double uniform(std::mt19937_64& rng, double lo, double hi) { return lo + (hi - lo) * double(rng() >> 11) * 0x1p-53; }

Vec3 uniform3(std::mt19937_64& rng, double lo, double hi) {
    const double x = uniform(rng, lo, hi), y = uniform(rng, lo, hi), z = uniform(rng, lo, hi);
    return {x, y, z};
}

Mat3 random_axes(std::mt19937_64& rng) {
    Quat q;
    do q.coeffs() << uniform3(rng, -1, 1), uniform(rng, -1, 1);
    while (q.norm() < 0.1);
    return q.normalized().toRotationMatrix();
}

Ellipsoid random_ellipsoid(std::mt19937_64& rng, double spread, double aspect) {
    Ellipsoid e;
    e.center = uniform3(rng, -spread, spread);
    e.axes = random_axes(rng);
    for (int i = 0; i < 3; ++i) e.radii[i] = std::exp(uniform(rng, 0, std::log(aspect))) / std::sqrt(aspect);
    return e;
}

double bound(const Ellipsoid& a, const Ellipsoid& b, const Vec3& n) {
    return n.dot(a.center - b.center) - (a.radii.asDiagonal() * (a.axes.transpose() * n)).norm() -
           (b.radii.asDiagonal() * (b.axes.transpose() * n)).norm();
}

/// The best of 4000 directions of a spiral, each of the ten best then refined by shrinking steps on the sphere.
double brute_force_gap(const Ellipsoid& a, const Ellipsoid& b) {
    constexpr int kDirections = 4000;
    std::vector<std::pair<double, Vec3>> samples;
    for (int k = 0; k < kDirections; ++k) {
        const double z = 1 - (2 * k + 1.0) / kDirections, phi = k * 2.399963229728653, r = std::sqrt(1 - z * z);
        const Vec3 n(r * std::cos(phi), r * std::sin(phi), z);
        samples.push_back({bound(a, b, n), n});
    }
    std::partial_sort(samples.begin(), samples.begin() + 10, samples.end(),
                      [](const auto& x, const auto& y) { return x.first > y.first; });
    double best = -1e300;
    for (int s = 0; s < 10; ++s) {
        auto [f, n] = samples[s];
        for (double step = 0.1; step > 1e-7;) {
            const Vec3 t1 = n.unitOrthogonal(), t2 = n.cross(t1);
            bool rose = false;
            for (int k = 0; k < 8 && !rose; ++k) {
                const Vec3 m = (n + step * (std::cos(k * M_PI / 4) * t1 + std::sin(k * M_PI / 4) * t2)).normalized();
                const double g = bound(a, b, m);
                if (g > f) { f = g; n = m; rose = true; }
            }
            if (!rose) step *= 0.5;
        }
        best = std::max(best, f);
    }
    return best;
}

void expect_whole(const Separation& s, double size) {
    EXPECT_NEAR(s.normal.norm(), 1, 1e-12);
    EXPECT_NEAR(s.normal.dot(s.point_a - s.point_b), s.gap, 1e-12 * size);  // rounding of one dot product
    EXPECT_TRUE(s.point_a.allFinite() && s.point_b.allFinite() && std::isfinite(s.gap));
}

class EllipsoidPairs : public testing::TestWithParam<double> {};

TEST_P(EllipsoidPairs, the_best_direction_of_a_brute_force_search_is_found) {
    const double aspect = GetParam();
    auto rng = generator(11);
    int overlapping = 0, missed = 0;
    double worst = 0;
    constexpr int kPairs = 3000;
    for (int k = 0; k < kPairs; ++k) {
        const Ellipsoid a = random_ellipsoid(rng, 0, aspect);
        Ellipsoid b = random_ellipsoid(rng, 0, aspect);
        const double mean = (a.radii.sum() + b.radii.sum()) / 6;
        b.center = uniform3(rng, -1, 1).normalized() * uniform(rng, 0, 3) * mean;
        const double truth = brute_force_gap(a, b);
        const Separation s = ellipsoid_distance(a, b);
        expect_whole(s, mean);
        overlapping += truth < 0;
        // The search itself is short of the maximum by about step^2 * radius: 1e-12.
        EXPECT_LE(s.gap, truth + 1e-9 * mean) << "pair " << k;
        EXPECT_LE(s.gap, bound(a, b, s.normal) + 1e-12 * mean);
        worst = std::max(worst, (truth - s.gap) / mean);
        missed += truth - s.gap > 1e-3 * mean;
    }
    EXPECT_GT(overlapping, kPairs / 5);
    EXPECT_LT(overlapping, kPairs * 4 / 5);
    RecordProperty("missed", missed);
    EXPECT_EQ(missed, 0) << "worst " << worst;
}
INSTANTIATE_TEST_SUITE_P(Aspects, EllipsoidPairs, testing::Values(1.0, 3.0, 10.0));

TEST(ellipsoid_distance, thin_needles_and_discs_keep_a_safe_and_useful_gap) {
    auto rng = generator(12);
    double worst = 0, worst_separated = 0;
    for (int k = 0; k < 1500; ++k) {
        const Ellipsoid a = random_ellipsoid(rng, 1, 50), b = random_ellipsoid(rng, 1, 50);
        const double mean = (a.radii.sum() + b.radii.sum()) / 6;
        const double truth = brute_force_gap(a, b);
        const Separation s = ellipsoid_distance(a, b);
        expect_whole(s, mean);
        EXPECT_LE(s.gap, truth + 1e-6 * mean) << "pair " << k;  // the spiral's spacing leaves it short at 50:1
        if (truth > 0) worst_separated = std::max(worst_separated, (truth - s.gap) / mean);
        worst = std::max(worst, (truth - s.gap) / mean);
    }
    RecordProperty("worst", std::to_string(worst));
    EXPECT_LT(worst_separated, 1e-3);
    EXPECT_LT(worst, 0.02);  // a wrong valley of a deep overlap costs a longer way out, not a wrong sign
}

TEST(ellipsoid_distance, swapping_the_pair_gives_the_same_bits) {
    auto rng = generator(13);
    for (int k = 0; k < 2000; ++k) {
        const Ellipsoid a = random_ellipsoid(rng, k % 3 ? 1.5 : 0, 8), b = random_ellipsoid(rng, k % 3 ? 1.5 : 0, 8);
        const Separation ab = ellipsoid_distance(a, b), ba = ellipsoid_distance(b, a);
        EXPECT_EQ(ab.gap, ba.gap);
        EXPECT_EQ(ab.normal, -ba.normal);
        EXPECT_EQ(ab.point_a, ba.point_b);
        EXPECT_EQ(ab.point_b, ba.point_a);
    }
}

TEST(ellipsoid_distance, spheres_have_the_closed_form) {
    auto rng = generator(14);
    for (int k = 0; k < 500; ++k) {
        Ellipsoid a = random_ellipsoid(rng, 2, 1), b = random_ellipsoid(rng, 2, 1);
        a.radii.setConstant(uniform(rng, 0.1, 2));
        b.radii.setConstant(uniform(rng, 0.1, 2));
        const Separation s = ellipsoid_distance(a, b);
        EXPECT_NEAR(s.gap, (a.center - b.center).norm() - a.radii[0] - b.radii[0], 1e-12);
        EXPECT_NEAR((s.normal - (a.center - b.center).normalized()).norm(), 0, 1e-7);
    }
}

TEST(ellipsoid_distance, coinciding_centres_part_along_a_thin_direction) {
    Ellipsoid a, b;
    a.radii = Vec3(3, 0.2, 1);
    b.radii = Vec3(2, 0.5, 4);
    const Separation s = ellipsoid_distance(a, b);
    EXPECT_NEAR(s.gap, -0.7, 1e-12);
    EXPECT_NEAR(std::abs(s.normal.y()), 1, 1e-9);
    const Separation same = ellipsoid_distance(a, a);
    EXPECT_NEAR(same.gap, -0.4, 1e-12);
    expect_whole(same, 1);
}

TEST(ellipsoid_distance, scale_does_not_matter) {
    auto rng = generator(15);
    for (int k = 0; k < 200; ++k) {
        Ellipsoid a = random_ellipsoid(rng, 1.5, 6), b = random_ellipsoid(rng, 1.5, 6);
        const Separation s = ellipsoid_distance(a, b);
        for (const double scale : {0x1p-20, 0x1p20}) {  // powers of two: exact
            Ellipsoid p = a, q = b;
            p.center *= scale; p.radii *= scale;
            q.center *= scale; q.radii *= scale;
            EXPECT_NEAR(ellipsoid_distance(p, q).gap / scale, s.gap, 1e-12);
        }
    }
}

TEST(ellipsoid_distance, a_warm_start_is_never_worse_than_itself) {
    auto rng = generator(16);
    for (int k = 0; k < 500; ++k) {
        const Ellipsoid a = random_ellipsoid(rng, 1.5, 20), b = random_ellipsoid(rng, 1.5, 20);
        const Vec3 start = uniform3(rng, -1, 1);
        EXPECT_GE(ellipsoid_distance(a, b, start).gap, bound(a, b, start.normalized()) - 1e-12);
    }
    const Ellipsoid a, b;
    expect_whole(ellipsoid_distance(a, b, Vec3::Zero()), 1);  // no direction at all is a start too
}

}  // namespace
}  // namespace sunder
