#include "fracture_tools/voronoi/interface_triangulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

namespace sunder {
namespace {

using Loop = std::vector<uint32_t>;

FilledOutline fill(const std::vector<Vec3>& points, const std::vector<Loop>& loops, const Vec3& normal) {
    const std::vector<std::span<const uint32_t>> views(loops.begin(), loops.end());
    return fill_outline(points, views, normal);
}

/// Whether the loops' sides, in their direction, are the border of the triangles.
bool closes(const std::vector<Triangle>& triangles, const std::vector<Loop>& loops) {
    std::map<std::pair<uint32_t, uint32_t>, int> surplus;
    for (const Triangle& t : triangles)
        for (int c = 0; c < 3; ++c) ++surplus[{t[c], t[(c + 1) % 3]}], --surplus[{t[(c + 1) % 3], t[c]}];
    for (const Loop& l : loops)
        for (size_t k = 0; k < l.size(); ++k)
            --surplus[{l[k], l[(k + 1) % l.size()]}], ++surplus[{l[(k + 1) % l.size()], l[k]}];
    for (const auto& [side, n] : surplus)
        if (n != 0) return false;
    return true;
}

double area(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles, const Vec3& normal) {
    double sum = 0;
    for (const auto& [a, b, c] : triangles)
        sum += 0.5 * (points[b] - points[a]).cross(points[c] - points[a]).dot(normal.normalized());
    return sum;
}

/// A polygon about the origin in the plane across `normal`, counter-clockwise against it.
void add_polygon(const Vec3& normal, double radius, int n, std::vector<Vec3>& io_points, Loop& out,
                 Vec3 shift = Vec3::Zero()) {
    const Vec3 u = normal.unitOrthogonal(), v = normal.normalized().cross(u);
    for (int k = 0; k < n; ++k) {
        const double angle = 2 * std::numbers::pi * k / n;
        out.push_back(uint32_t(io_points.size()));
        io_points.push_back(shift + radius * (std::cos(angle) * u + std::sin(angle) * v));
    }
}

TEST(FillOutline, a_ring_is_filled_between_its_loops_whichever_way_it_lies) {
    for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(0, 0, -2), Vec3(3, 1, 0.5), Vec3(-1, 0.2, 0.1), Vec3(0.1, -5, 1)}) {
        std::vector<Vec3> points;
        std::vector<Loop> loops(2);
        add_polygon(normal, 2, 24, points, loops[0]);
        add_polygon(normal, 1, 24, points, loops[1]);
        std::reverse(loops[1].begin(), loops[1].end());
        const FilledOutline filled = fill(points, loops, normal);
        EXPECT_FALSE(filled.may_overlap);
        EXPECT_EQ(filled.triangles.size(), 48u);
        EXPECT_TRUE(closes(filled.triangles, loops));
        EXPECT_NEAR(area(points, filled.triangles, normal), 12 * std::sin(std::numbers::pi / 12) * 3, 1e-12);
        for (const Triangle& t : filled.triangles) EXPECT_GT(area(points, {t}, normal), 0);
    }
}

TEST(FillOutline, parts_that_lie_apart_or_touch_are_filled_each) {
    const Vec3 normal(0, 0, 1);
    std::vector<Vec3> points = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0),
                                Vec3(1, 0, 0), Vec3(2, 0, 0), Vec3(2, 1, 0), Vec3(1, 1, 0)};  // a side in common
    const std::vector<Loop> loops = {{0, 1, 2, 3}, {4, 5, 6, 7}};
    for (double gap : {0.0, 0.5}) {
        for (int k = 4; k < 8; ++k) points[k].x() += gap;
        const FilledOutline filled = fill(points, loops, normal);
        EXPECT_FALSE(filled.may_overlap);
        EXPECT_TRUE(closes(filled.triangles, loops));
        EXPECT_NEAR(area(points, filled.triangles, normal), 2, 1e-15);
    }
}

TEST(FillOutline, vertices_in_one_place_stay_in_the_border) {
    const Vec3 normal(0, 0, 1);
    const std::vector<Vec3> points = {Vec3(0, 0, 0), Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0),
                                      Vec3(1, 1, 0), Vec3(1, 1, 0), Vec3(0, 1, 0), Vec3(0, 0, 0)};
    const std::vector<Loop> loops = {{0, 1, 2, 3, 4, 5, 6, 7}};
    const FilledOutline filled = fill(points, loops, normal);
    EXPECT_FALSE(filled.may_overlap);
    EXPECT_TRUE(closes(filled.triangles, loops));
    EXPECT_EQ(filled.triangles.size(), 6u);
    EXPECT_NEAR(area(points, filled.triangles, normal), 1, 1e-15);
}

TEST(FillOutline, points_in_a_row_make_no_degenerate_triangles) {
    const Vec3 normal(0, 1, 0);
    std::vector<Vec3> points;
    Loop loop;
    for (int k = 0; k <= 10; ++k) loop.push_back(uint32_t(points.size())), points.push_back(Vec3(0, 0, 0.1 * k));
    points.push_back(Vec3(1, 0, 0.3)), loop.push_back(11);
    const FilledOutline filled = fill(points, {loop}, normal);
    EXPECT_FALSE(filled.may_overlap);
    for (const Triangle& t : filled.triangles) EXPECT_GT(area(points, {t}, normal), 0.01);
}

TEST(FillOutline, an_outline_that_crosses_itself_is_still_closed) {
    const Vec3 normal(0, 0, 1);
    const std::vector<Vec3> points = {Vec3(0, 0, 0), Vec3(1, 1, 0), Vec3(1, 0, 0), Vec3(0, 1.5, 0)};
    const std::vector<Loop> loops = {{0, 1, 2, 3}};
    const FilledOutline filled = fill(points, loops, normal);
    EXPECT_TRUE(filled.may_overlap);
    EXPECT_TRUE(closes(filled.triangles, loops));
}

TEST(FillOutline, an_outline_without_any_area_is_closed) {
    const std::vector<Vec3> points = {Vec3(0, 0, 0), Vec3(1, 2, 0), Vec3(3, 6, 0), Vec3(2, 4, 0)};
    const std::vector<Loop> loops = {{0, 1, 2, 3}};
    EXPECT_TRUE(closes(fill(points, loops, Vec3(0, 0, 1)).triangles, loops));
}

// What the surface of a mesh that crosses itself leaves between cells: a few points of a small grid, so that many lie
// on one another, on sides and in rows.
TEST(FillOutline, whatever_the_outlines_are_they_are_closed) {
    std::mt19937 random(5);
    for (int run = 0; run < 20'000; ++run) {
        std::vector<Vec3> points;
        std::vector<Loop> loops(1 + random() % 3);
        const uint32_t width = 1 + random() % 5, height = 1 + random() % 3;
        for (Loop& loop : loops)
            for (uint32_t n = 3 + random() % 7; n > 0; --n) {
                loop.push_back(uint32_t(points.size()));
                points.push_back(Vec3(random() % width, random() % height, 0.1 * (random() % 3)));
                if (random() % 8 == 0) points.back() += 1e-16 * Vec3(random() % 3, random() % 3, 0);
                if (random() % 16 == 0) points.back() *= 1e9;
            }
        const FilledOutline filled = fill(points, loops, Vec3(0.1, 0.2, 1));
        ASSERT_TRUE(closes(filled.triangles, loops)) << "run " << run;
    }
}

}  // namespace
}  // namespace sunder
