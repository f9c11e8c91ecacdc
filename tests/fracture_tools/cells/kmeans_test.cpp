#include "fracture_tools/cells/kmeans.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "fracture_tools/mesh/point_grid.h"
#include "fracture_tools/mesh/surface_lookup.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

std::vector<Vec3> random_points(size_t n, const Vec3& size, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<Vec3> points;
    for (size_t i = 0; i < n; ++i) {
        Vec3 p;
        for (int k = 0; k < 3; ++k) p[k] = size[k] * (random() / 4294967296.0);
        points.push_back(p);
    }
    return points;
}

TEST(PointGrid, nearest_is_what_looking_at_all_points_finds) {
    for (const Vec3& size : {Vec3(1, 1, 1), Vec3(100, 1, 0.01), Vec3(1, 0, 0), Vec3(0, 0, 0)}) {
        const std::vector<Vec3> points = random_points(300, size, 1);
        const PointGrid grid(points);
        for (const Vec3& q : random_points(200, 1.5 * size + Vec3::Constant(0.1), 2)) {
            const Vec3 query = q - 0.25 * size;
            uint32_t best = 0;
            for (uint32_t i = 1; i < points.size(); ++i)
                if ((points[i] - query).squaredNorm() < (points[best] - query).squaredNorm()) best = i;
            EXPECT_EQ(grid.nearest(query), best);
            for (const uint32_t known : {0u, 150u, best}) {
                const PointGrid::Near near = grid.nearest(query, {known, (points[known] - query).squaredNorm()});
                EXPECT_EQ(near.index, best);
                EXPECT_EQ(near.squared_distance, (points[best] - query).squaredNorm());
            }
        }
    }
}

TEST(PointGrid, near_visits_all_points_of_the_ball) {
    const std::vector<Vec3> points = random_points(500, Vec3(2, 1, 0.5), 3);
    const PointGrid grid(points);
    std::set<uint32_t> seen;
    const Vec3 center(1, 0.5, 0.2);
    grid.visit_near(center, 0.3, [&](uint32_t i) { EXPECT_TRUE(seen.insert(i).second); });
    for (uint32_t i = 0; i < points.size(); ++i) EXPECT_TRUE((points[i] - center).norm() > 0.3 || seen.count(i) == 1);
    EXPECT_LT(seen.size(), points.size());
}

TEST(Kmeans, finds_groups_that_stand_apart_whatever_the_seed) {
    std::vector<Vec3> points;
    for (int group = 0; group < 8; ++group)
        for (const Vec3& p : random_points(50, Vec3::Constant(0.1), group))
            points.push_back(p + Vec3(group % 2, group / 2 % 2, group / 4));
    const std::vector<double> weights(points.size(), 1.0);
    for (uint64_t seed = 0; seed < 10; ++seed) {
        const auto label = kmeans_clusters(points, weights, 8, seed, 1);
        ASSERT_TRUE(label);
        std::set<uint32_t> used;
        for (size_t i = 0; i < points.size(); ++i) {
            EXPECT_EQ((*label)[i], (*label)[i / 50 * 50]);
            used.insert((*label)[i]);
        }
        EXPECT_EQ(used.size(), 8u);
    }
}

TEST(Kmeans, each_point_is_with_the_nearest_mean) {
    const std::vector<Vec3> points = random_points(3000, Vec3(1, 1, 1), 5);
    std::vector<double> weights;
    for (const Vec3& p : points) weights.push_back(1 + p.x());
    const auto label = kmeans_clusters(points, weights, 40, 1, 1);
    ASSERT_TRUE(label);
    std::vector<Vec3> sum(40, Vec3::Zero());
    std::vector<double> total(40, 0);
    for (size_t i = 0; i < points.size(); ++i)
        sum[(*label)[i]] += weights[i] * points[i], total[(*label)[i]] += weights[i];
    size_t wrong = 0;
    for (size_t i = 0; i < points.size(); ++i) {
        const uint32_t own = (*label)[i];
        for (uint32_t c = 0; c < 40; ++c) {
            ASSERT_GT(total[c], 0);
            if ((points[i] - sum[c] / total[c]).norm() < (points[i] - sum[own] / total[own]).norm() - 1e-9) {
                ++wrong;
                break;
            }
        }
    }
    EXPECT_LE(wrong, points.size() / 50);  // it ends when fewer than one in a thousand changes, not at rest
}

TEST(Kmeans, as_many_clusters_as_points_and_points_in_one_place_are_no_trouble) {
    const std::vector<Vec3> points = random_points(20, Vec3(1, 1, 1), 6);
    const auto each = kmeans_clusters(points, std::vector<double>(20, 0.1), 20, 0, 1);
    ASSERT_TRUE(each);
    EXPECT_EQ(std::set<uint32_t>(each->begin(), each->end()).size(), 20u);
    const std::vector<Vec3> same(10, Vec3(1, 2, 3));
    EXPECT_TRUE(kmeans_clusters(same, std::vector<double>(10, 1.0), 4, 0, 1));
    EXPECT_TRUE(kmeans_clusters(same, std::vector<double>(10, 0.0), 10, 0, 1));
}

TEST(Kmeans, the_seed_decides_and_is_the_same_on_every_machine) {
    const std::vector<Vec3> points = random_points(500, Vec3(1, 1, 1), 7);
    const std::vector<double> weights(500, 1.0);
    const auto a = kmeans_clusters(points, weights, 10, 1, 1), b = kmeans_clusters(points, weights, 10, 1, 1),
               c = kmeans_clusters(points, weights, 10, 2, 1);
    ASSERT_TRUE(a && b && c);
    EXPECT_EQ(*a, *b);
    EXPECT_NE(*a, *c);
}

TEST(Kmeans, any_number_of_threads_gives_the_same_labels) {
    const std::vector<Vec3> points = random_points(20000, Vec3(1, 1, 1), 9);  // five chunks
    const std::vector<double> weights(points.size(), 1.0);
    const auto one = kmeans_clusters(points, weights, 500, 1, 1);
    ASSERT_TRUE(one);
    for (const int threads : {2, 5}) EXPECT_EQ(*kmeans_clusters(points, weights, 500, 1, threads), *one);
}

TEST(SurfaceLookup, nearest_is_what_looking_at_all_triangles_finds) {
    const TriMesh torus = testing::make_torus(0.35, 0.15, 20, 10);
    const SurfaceLookup lookup(torus);
    for (const Vec3& q : random_points(300, Vec3(1.4, 1.4, 0.6), 8)) {
        const Vec3 query = q - Vec3(0.7, 0.7, 0.3);
        double best = 1e9;
        for (const Triangle& t : torus.triangles)
            best = std::min(
                best, nearest_on_triangle(query, torus.positions[t[0]], torus.positions[t[1]], torus.positions[t[2]])
                          .distance);
        const SurfacePoint p = lookup.nearest(query);
        EXPECT_EQ(p.distance, best);
        EXPECT_NEAR(p.barycentric.sum(), 1, 1e-12);
        EXPECT_GE(p.barycentric.minCoeff(), 0);
        EXPECT_NEAR((p.position - query).norm(), p.distance, 1e-15);
    }
}

TEST(SurfaceLookup, nearest_of_a_triangle_in_each_of_its_regions) {
    const Vec3 a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
    auto at = [&](const Vec3& q) { return nearest_on_triangle(q, a, b, c).position; };
    EXPECT_LT((at(Vec3(0.5, 0.5, 3)) - Vec3(0.5, 0.5, 0)).norm(), 1e-15);
    EXPECT_EQ(at(Vec3(-1, -1, 1)), a);
    EXPECT_EQ(at(Vec3(5, -1, 0)), b);
    EXPECT_EQ(at(Vec3(-1, 5, 0)), c);
    EXPECT_LT((at(Vec3(1, -1, 2)) - Vec3(1, 0, 0)).norm(), 1e-15);
    EXPECT_LT((at(Vec3(2, 2, 0)) - Vec3(1, 1, 0)).norm(), 1e-15);
    EXPECT_LT((nearest_on_triangle(Vec3(1, 1, 0), a, a, b).position - Vec3(1, 0, 0)).norm(), 1e-15);
}

}  // namespace
}  // namespace sunder
