// The grid finds what testing every pair finds, whatever the cloud.
#include "solver/collision/broad_phase.h"

#include <gtest/gtest.h>

#include "tests/solver/collision/collision_cases.h"

namespace sunder {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<Pair> every_overlap(std::span<const Aabb> boxes, const PairFilter& filter) {
    std::vector<Pair> pairs;
    for (uint32_t i = 0; i < boxes.size(); ++i)
        for (uint32_t j = i + 1; j < boxes.size(); ++j)
            if (overlap(boxes[i], boxes[j]) && !filter.excludes(i, j)) pairs.push_back({i, j});
    return pairs;
}

std::vector<Pair> grid_overlaps(std::span<const Aabb> boxes, const PairFilter& filter = {}) {
    OverlapScratch scratch;
    std::vector<Pair> pairs;
    find_overlaps(boxes, filter, scratch, pairs);
    return pairs;
}

Aabb box_at(const Vec3& center, const Vec3& half) { return {center - half, center + half}; }

/// Sizes spread over `ratio`, log-uniformly, in a cube that leaves a few neighbours each.
std::vector<Aabb> cloud(uint64_t seed, int n, double ratio, double spread) {
    auto rng = generator(seed);
    std::vector<Aabb> boxes;
    for (int k = 0; k < n; ++k) {
        const double size = 0.05 * std::exp(uniform(rng, 0, std::log(ratio)));
        boxes.push_back(box_at(uniform3(rng, -spread, spread), size * uniform3(rng, 0.3, 1)));
    }
    return boxes;
}

void expect_same_as_brute_force(const std::vector<Aabb>& boxes, size_t at_least) {
    const auto truth = every_overlap(boxes, {}), found = grid_overlaps(boxes);
    EXPECT_GE(truth.size(), at_least) << "the case shows nothing";
    EXPECT_TRUE(found == truth) << found.size() << " pairs of " << truth.size();
}

TEST(broad_phase, clouds_of_any_size_ratio_lose_no_pair) {
    for (const double ratio : {1.0, 3.0, 30.0, 1e4, 1e8}) expect_same_as_brute_force(cloud(31, 1500, ratio, 0.8), 500);
}

TEST(broad_phase, one_boulder_among_grains_touches_them_all) {
    auto boxes = cloud(32, 2000, 2, 1);
    boxes.push_back(box_at(Vec3::Zero(), Vec3::Constant(50)));
    boxes.insert(boxes.begin(), box_at(Vec3(0.5, 0, 0), Vec3(1000, 0.01, 1000)));
    expect_same_as_brute_force(boxes, 2000);
}

TEST(broad_phase, a_runaway_does_not_hide_the_others) {
    auto boxes = cloud(33, 800, 2, 0.7);
    boxes.push_back(box_at(Vec3(1e12, -1e12, 3), Vec3::Constant(0.1)));
    boxes.push_back(box_at(Vec3(1e12, -1e12, 3), Vec3::Constant(0.1)));
    boxes.push_back(box_at(Vec3(-1e9, 0, 0), Vec3::Constant(0.1)));
    expect_same_as_brute_force(boxes, 300);
}

TEST(broad_phase, coinciding_boxes_and_points_give_every_pair_once) {
    expect_same_as_brute_force(std::vector<Aabb>(60, box_at(Vec3(1, 2, 3), Vec3::Constant(0.5))), 60 * 59 / 2);
    expect_same_as_brute_force(std::vector<Aabb>(60, box_at(Vec3(1, 2, 3), Vec3::Zero())), 60 * 59 / 2);
    std::vector<Aabb> points;
    for (int k = 0; k < 40; ++k) points.push_back(box_at(Vec3(k / 4, 0, 0), Vec3::Zero()));
    expect_same_as_brute_force(points, 10 * 6);
}

TEST(broad_phase, boxes_that_only_touch_on_cell_borders_are_found) {
    std::vector<Aabb> boxes;  // a lattice: faces, edges and corners coincide exactly
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y)
            for (int z = 0; z < 8; ++z) boxes.push_back(box_at(Vec3(x, y, z), Vec3::Constant(0.5)));
    expect_same_as_brute_force(boxes, 3 * 7 * 64);
}

TEST(broad_phase, nothing_and_one_and_spoilt_boxes_are_no_trouble) {
    EXPECT_TRUE(grid_overlaps({}).empty());
    const std::vector<Aabb> one = {box_at(Vec3::Zero(), Vec3::Ones())};
    EXPECT_TRUE(grid_overlaps(one).empty());
    std::vector<Aabb> boxes = {one[0], box_at(Vec3(kNan, 0, 0), Vec3::Ones()), Aabb(), one[0],
                               box_at(Vec3::Zero(), Vec3::Constant(std::numeric_limits<double>::infinity()))};
    EXPECT_EQ(grid_overlaps(boxes), (std::vector<Pair>{{0, 3}}));
}

TEST(broad_phase, particles_that_share_a_neighbour_are_left_out_until_an_edge_breaks) {
    // A row of four joined 0-1-2-3, all within one another's boxes; item 4 is a rigid body.
    const std::vector<Aabb> boxes(5, box_at(Vec3::Zero(), Vec3::Ones()));
    const std::vector<uint32_t> offset = {0, 2, 5, 8, 10}, member = {0, 1, 0, 1, 2, 1, 2, 3, 2, 3};
    const std::vector<uint32_t> edge = {9, 0, 0, 9, 1, 1, 9, 2, 2, 9};
    std::vector<uint8_t> intact = {1, 1, 1, 0, 0, 0, 0, 0, 0, 0};
    PairFilter filter;
    filter.n_particles = 4;
    filter.rings = {std::span(offset).first(4), std::span(offset).last(4), member, edge, intact};
    EXPECT_EQ(grid_overlaps(boxes, filter), (std::vector<Pair>{{0, 3}, {0, 4}, {1, 4}, {2, 4}, {3, 4}}));
    intact[1] = 0;
    EXPECT_EQ(grid_overlaps(boxes, filter).size(), 8u);
    EXPECT_FALSE(filter.excludes(1, 2));
    const std::vector<uint32_t> body = {0, 0, 1, 1};
    filter.body = body;
    filter.self_collision = false;
    EXPECT_EQ(grid_overlaps(boxes, filter),
              (std::vector<Pair>{{0, 2}, {0, 3}, {0, 4}, {1, 2}, {1, 3}, {1, 4}, {2, 4}, {3, 4}}));
}

TEST(broad_phase, remembered_pairs_hold_whatever_moves) {
    auto boxes = cloud(34, 600, 5, 0.6);
    auto rng = generator(35);
    CandidatePairs remembered;
    PairFilter filter;
    size_t moves = 0;
    for (int step = 0; step < 60; ++step, ++moves) {
        for (Aabb& box : boxes) {
            const Vec3 shift = uniform3(rng, -0.002, 0.002);
            box.min += shift;
            box.max += shift;
        }
        if (step % 20 == 19) {
            boxes[7].min.array() += 0.5;
            boxes[7].max.array() += 0.5;
        }  // one leaps
        const auto candidates = remembered.update(boxes, filter);
        EXPECT_TRUE(std::is_sorted(candidates.begin(), candidates.end()));
        for (const Pair& pair : every_overlap(boxes, filter))
            ASSERT_TRUE(std::binary_search(candidates.begin(), candidates.end(), pair)) << "step " << step;
    }
    EXPECT_LT(remembered.n_rebuilds(), moves / 2);  // it does remember
    EXPECT_GE(remembered.n_rebuilds(), 3u);         // and does forget
    const size_t before = remembered.n_rebuilds();
    remembered.update(boxes, filter);
    EXPECT_EQ(remembered.n_rebuilds(), before);
    remembered.reset();
    remembered.update(boxes, filter);
    EXPECT_EQ(remembered.n_rebuilds(), before + 1);
    filter.self_collision = false;
    remembered.update(boxes, filter);
    boxes.pop_back();
    remembered.update(boxes, filter);
    EXPECT_EQ(remembered.n_rebuilds(), before + 3);
}

}  // namespace
}  // namespace sunder
