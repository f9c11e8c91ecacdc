#include "fracture_tools/cells/kmeans_seeding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

namespace sunder {
namespace {

double share_of(std::mt19937_64& io_random) { return double(io_random() >> 11) * 0x1p-53; }

std::vector<Vec3> points_in_box(size_t n, const Vec3& size) {
    std::mt19937_64 random(3);
    std::vector<Vec3> points(n);
    for (Vec3& p : points)
        for (int k = 0; k < 3; ++k) p[k] = size[k] * share_of(random);
    return points;
}

/// As the paper has it: all distances measured anew, and one sum from the first point on.
std::vector<Vec3> seeded_plainly(const std::vector<Vec3>& points, const std::vector<double>& weights, uint32_t n,
                                 uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<Vec3> centers;
    while (centers.size() < n) {
        std::vector<double> drawn = weights;
        for (size_t i = 0; i < points.size() && !centers.empty(); ++i) {
            double least = HUGE_VAL;
            for (const Vec3& c : centers) least = std::min(least, (points[i] - c).squaredNorm());
            drawn[i] *= least;
        }
        double rest = 0;
        for (double w : drawn) rest += w;
        rest *= share_of(random);
        size_t i = 0;
        while (i + 1 < drawn.size() && drawn[i] <= rest) rest -= drawn[i++];
        centers.push_back(points[i]);
    }
    return centers;
}

// Sums are added up in another order, to about 1e-13 of the whole: of 200 draws among 2500 points one in 1e8 times one
// goes to another point.
TEST(KmeansSeeding, draws_what_measuring_all_distances_anew_draws) {
    for (const Vec3& size : {Vec3(1, 1, 1), Vec3(20, 1, 0.05), Vec3(1, 0, 0)}) {
        const std::vector<Vec3> points = points_in_box(2500, size);
        std::vector<double> weights;
        for (size_t i = 0; i < points.size(); ++i) weights.push_back(i % 3 == 0 ? 0 : 1 + double(i % 7));
        const std::vector<Vec3> centers = seed_centers(PointGrid(points), weights, 200, 5);
        EXPECT_EQ(centers, seeded_plainly(points, weights, 200, 5));
    }
}

TEST(KmeansSeeding, points_that_coincide_come_last) {
    std::vector<Vec3> points = points_in_box(30, Vec3(1, 1, 1));
    points.insert(points.end(), 70, points[0]);
    const std::vector<Vec3> centers = seed_centers(PointGrid(points), std::vector<double>(100, 0.5), 35, 1);
    const auto less = [](const Vec3& a, const Vec3& b) { return std::ranges::lexicographical_compare(a, b); };
    const std::set<Vec3, decltype(less)> first(centers.begin(), centers.begin() + 30, less);
    EXPECT_EQ(first.size(), 30u);
    EXPECT_EQ(centers.size(), 35u);
}

TEST(KmeansSeeding, without_any_weight_points_come_in_their_order) {
    const std::vector<Vec3> points = points_in_box(10, Vec3(1, 1, 1));
    EXPECT_EQ(seed_centers(PointGrid(points), std::vector<double>(10, 0.0), 10, 1), points);
}

}  // namespace
}  // namespace sunder
