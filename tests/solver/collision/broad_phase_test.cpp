// The sweep and the grid find what testing every pair finds, whatever the cloud.
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

std::vector<Pair> ascending(std::vector<Pair> pairs) {
    for (auto& [i, j] : pairs)
        if (i > j) std::swap(i, j);
    std::ranges::sort(pairs);
    return pairs;
}

std::vector<Pair> overlaps(std::span<const Aabb> boxes, const PairFilter& filter = {}) {
    OverlapScratch scratch;
    std::vector<Pair> pairs, in_grid;
    find_overlaps(boxes, filter, WorkerPool(3), scratch, pairs);
    find_in_grid(boxes, scratch, in_grid);
    filter.remove_excluded(scratch.near, in_grid);
    EXPECT_TRUE(ascending(pairs) == ascending(in_grid)) << pairs.size() << ", in the grid " << in_grid.size();
    return ascending(pairs);
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
    const auto truth = every_overlap(boxes, {}), found = overlaps(boxes);
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

// Far from the origin floats are coarser than the boxes.
TEST(broad_phase, boxes_far_away_are_told_apart) {
    auto boxes = cloud(34, 1000, 3, 0.8);
    for (Aabb& box : boxes) box.min.array() += 3e6, box.max.array() += 3e6;
    expect_same_as_brute_force(boxes, 500);
}

// More than the sweep takes: all overlap along every axis, few in space.
TEST(broad_phase, long_rods_across_one_another_go_to_the_grid) {
    auto rng = generator(36);
    std::vector<Aabb> boxes;
    for (int k = 0; k < 9000; ++k) {
        Vec3 half = Vec3::Constant(0.002);
        half[k % 3] = 1;
        boxes.push_back(box_at(uniform3(rng, -1, 1), half));
    }
    OverlapSweep sweep;
    EXPECT_GT(sweep.sort(boxes, std::vector<uint8_t>(boxes.size(), 1), WorkerPool(1)), 2000 * boxes.size());
    expect_same_as_brute_force(boxes, 500);
}

// What is kept of the order changes no pair, whether boxes creep, jump, come or go; nor do threads.
TEST(broad_phase, boxes_that_were_sorted_before_are_found_as_if_they_were_not) {
    auto rng = generator(38);
    std::vector<Aabb> boxes = cloud(37, 900, 3, 0.5);
    OverlapScratch kept;
    std::vector<Pair> pairs, serial;
    const WorkerPool alone(1), three(3);
    for (int step = 0; step < 30; ++step) {
        const double way = step % 5 == 4 ? 0.5 : 0.002;
        for (Aabb& box : boxes) {
            const Vec3 shift = uniform3(rng, -way, way);
            box.min += shift, box.max += shift;
        }
        if (step % 7 == 6) boxes[step] = Aabb();
        if (step % 11 == 10) boxes.resize(boxes.size() - 20);
        find_overlaps(boxes, {}, three, kept, pairs);
        OverlapScratch fresh;
        find_overlaps(boxes, {}, alone, fresh, serial);
        EXPECT_TRUE(pairs == serial);
        EXPECT_TRUE(ascending(pairs) == every_overlap(boxes, {}));
        EXPECT_GT(pairs.size(), 100u);
    }
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
    EXPECT_TRUE(overlaps({}).empty());
    const std::vector<Aabb> one = {box_at(Vec3::Zero(), Vec3::Ones())};
    EXPECT_TRUE(overlaps(one).empty());
    std::vector<Aabb> boxes = {one[0], box_at(Vec3(kNan, 0, 0), Vec3::Ones()), Aabb(), one[0],
                               box_at(Vec3::Zero(), Vec3::Constant(std::numeric_limits<double>::infinity()))};
    EXPECT_EQ(overlaps(boxes), (std::vector<Pair>{{0, 3}}));
}

TEST(broad_phase, particles_that_share_a_neighbour_are_left_out_until_an_edge_breaks) {
    // A row of four joined 0-1-2-3, all within one another's boxes; item 4 is a rigid body.
    const std::vector<Aabb> boxes(5, box_at(Vec3::Zero(), Vec3::Ones()));
    const std::vector<uint32_t> offset = {0, 2, 5, 8, 10};
    std::vector<ParticleId> member;
    for (const int i : {0, 1, 0, 1, 2, 1, 2, 3, 2, 3}) member.emplace_back(i);
    std::vector<EdgeId> edge;
    for (const int e : {9, 0, 0, 9, 1, 1, 9, 2, 2, 9}) edge.emplace_back(e);
    std::vector<uint8_t> intact = {1, 1, 1, 0, 0, 0, 0, 0, 0, 0};
    PairFilter filter;
    filter.n_particles = 4;
    filter.rings = {std::span(offset).first(4), std::span(offset).last(4), member, edge, intact};
    EXPECT_EQ(overlaps(boxes, filter), (std::vector<Pair>{{0, 3}, {0, 4}, {1, 4}, {2, 4}, {3, 4}}));
    intact[1] = 0;
    EXPECT_EQ(overlaps(boxes, filter).size(), 8u);
    EXPECT_FALSE(filter.excludes(1, 2));
    for (ParticleId i(0); i < 4; ++i) {
        std::vector<uint32_t> mark(4, 9);
        filter.rings.mark_near(i, mark);
        for (uint32_t j = 0; j < 4; ++j) {
            if (j == i) continue;
            EXPECT_EQ(mark[j] == i, filter.rings.near(i, j)) << i << " " << j;
        }
    }
    const std::vector<uint32_t> body = {0, 0, 1, 1};
    filter.body = body;
    filter.self_collision = false;
    EXPECT_EQ(overlaps(boxes, filter),
              (std::vector<Pair>{{0, 2}, {0, 3}, {0, 4}, {1, 2}, {1, 3}, {1, 4}, {2, 4}, {3, 4}}));
}

}  // namespace
}  // namespace sunder
