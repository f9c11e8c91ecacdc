// Distance of ellipsoids against a brute-force search over all directions.
#include "solver/collision/ellipsoid_distance.h"

#include <gtest/gtest.h>

#include "tests/solver/collision/collision_cases.h"

namespace sunder {
namespace {

double bound(const Ellipsoid& a, const Ellipsoid& b, const Vec3& n) {
    return n.dot(a.center - b.center) - (a.radii.asDiagonal() * (a.axes.transpose() * n)).norm() -
           (b.radii.asDiagonal() * (b.axes.transpose() * n)).norm();
}

double brute_force_gap(const Ellipsoid& a, const Ellipsoid& b) {
    return brute_force_maximum([&](const Vec3& n) { return bound(a, b, n); });
}

class EllipsoidPairs : public testing::TestWithParam<double> {};

TEST_P(EllipsoidPairs, the_best_direction_of_a_brute_force_search_is_found) {
    const double aspect = GetParam();
    auto rng = generator(11);
    int overlapping = 0, missed = 0;
    double worst = 0;
    constexpr int kPairs = 2000;
    for (int k = 0; k < kPairs; ++k) {
        const Ellipsoid a = random_ellipsoid(rng, 0, aspect);
        Ellipsoid b = random_ellipsoid(rng, 0, aspect);
        const double mean = (a.radii.sum() + b.radii.sum()) / 6;
        b.center = uniform3(rng, -1, 1).normalized() * uniform(rng, 0, 3) * mean;
        const double truth = brute_force_gap(a, b);
        const Separation s = ellipsoid_distance(a, b);
        expect_whole(s, mean);
        overlapping += truth < 0;
        // The search itself is short of the maximum by about step^2 * radius.
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
INSTANTIATE_TEST_SUITE_P(Aspects, EllipsoidPairs, testing::Values(1.0, 1.5, 3.0, 10.0));

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
            p.center *= scale;
            p.radii *= scale;
            q.center *= scale;
            q.radii *= scale;
            EXPECT_NEAR(ellipsoid_distance(p, q).gap / scale, s.gap, 1e-12);
        }
    }
}

// One by one, together, and on any processor.
TEST(ellipsoid_distance, pairs_side_by_side_keep_their_bits) {
    auto rng = generator(16);
    std::vector<Ellipsoid> solids;
    std::vector<std::pair<uint32_t, uint32_t>> pairs;
    for (uint32_t k = 0; k < 150; ++k) {  // from deep in one another to apart
        solids.push_back(random_ellipsoid(rng, k % 2 ? 2 : 0.3, 20));
        for (uint32_t j = k - k % 5; j < k; ++j) pairs.push_back({k, j});
    }
    solids[7] = solids[6];
    EllipsoidArrays arrays;
    const ParticleEllipsoids particles = arrays.of(solids);
    std::vector<Separation> together(pairs.size()), avx2(pairs.size()), portable(pairs.size());
    ellipsoid_distances(particles, {}, pairs, together);
    setenv("SUNDER_INSTRUCTIONS", "avx2", 1);
    ellipsoid_distances(particles, {}, pairs, avx2);
    setenv("SUNDER_INSTRUCTIONS", "portable", 1);
    ellipsoid_distances(particles, {}, pairs, portable);
    unsetenv("SUNDER_INSTRUCTIONS");
    for (size_t k = 0; k < pairs.size(); ++k) {
        const Separation alone = ellipsoid_distance(particles[pairs[k].first], particles[pairs[k].second]);
        for (const Separation& s : {together[k], avx2[k], portable[k]}) {
            EXPECT_EQ(s.gap, alone.gap) << k;
            EXPECT_EQ(s.normal, alone.normal) << k;
            EXPECT_EQ(s.point_a, alone.point_a) << k;
            EXPECT_EQ(s.point_b, alone.point_b) << k;
        }
    }
}

}  // namespace
}  // namespace sunder
