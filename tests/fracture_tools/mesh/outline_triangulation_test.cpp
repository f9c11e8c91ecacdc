#include "fracture_tools/mesh/outline_triangulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/fracture_tools/polygons.h"

namespace sunder {
namespace {

using testing::area_of_polygon;
using testing::concave_polygons;
using testing::NamedPolygon;
using testing::placed;

/// Vertices of a polygon's corners: equal positions are one.
std::vector<uint32_t> welded(const std::vector<Vec3>& corners) {
    std::vector<uint32_t> vertex;
    for (const Vec3& p : corners) vertex.push_back(uint32_t(std::ranges::find(corners, p) - corners.begin()));
    return vertex;
}

double area_of(const std::vector<Vec3>& p, const Triangle& t) {
    return 0.5 * (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).norm();
}

TEST(TriangulatePolygon, fills_any_polygon_from_any_corner_wherever_it_lies) {
    for (const NamedPolygon& polygon : concave_polygons())
        for (double angle : {0.0, 0.3, 1.7})
            for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(1000, -300, 77.7)}) {
                SCOPED_TRACE(polygon.name);
                const std::vector<Vec3> whole = placed(polygon.corners, angle, shift);
                const double area = area_of_polygon(polygon.corners);
                for (size_t start = 0; start < whole.size(); ++start) {
                    std::vector<Vec3> corners = whole;
                    std::rotate(corners.begin(), corners.begin() + std::ptrdiff_t(start), corners.end());
                    const auto triangles = triangulate_polygon(corners, welded(corners));
                    ASSERT_TRUE(triangles) << "from corner " << start;
                    EXPECT_EQ(triangles->size(), corners.size() - 2);
                    double sum = 0, least = area;
                    for (const Triangle& t : *triangles) {
                        sum += area_of(corners, t);
                        least = std::min(least, area_of(corners, t));
                    }
                    // Rounded at a thousand metres, where coordinates are 1e-13 m apart.
                    EXPECT_NEAR(sum, area, shift.isZero(0) ? 1e-14 * area : 1e-12 * area);
                    EXPECT_GT(least, 1e-3 * area) << "a sliver from corner " << start;
                }
            }
}

TEST(TriangulatePolygon, a_convex_one_is_a_fan_from_its_first_corner) {
    std::vector<Vec3> corners;
    for (int k = 0; k < 7; ++k) corners.push_back(Vec3(std::cos(0.8 * k), std::sin(0.8 * k), 0.1 * std::cos(3 * k)));
    const auto triangles = triangulate_polygon(corners, welded(corners));
    ASSERT_TRUE(triangles);
    EXPECT_EQ(*triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 6}}));
}

TEST(TriangulatePolygon, a_quad_with_a_blunt_corner_is_cut_there) {
    for (double y : {0.2, 0.0}) {  // bent inward, straight
        const std::vector<Vec3> corners = {Vec3(-1, 0, 0), Vec3(0, y, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
        const auto triangles = triangulate_polygon(corners, welded(corners));
        ASSERT_TRUE(triangles);
        EXPECT_EQ(*triangles, (std::vector<Triangle>{{1, 2, 3}, {1, 3, 0}}));
    }
}

// Each side of the bridge may have UVs of its own: a triangle takes those of the side that it lies on.
TEST(TriangulatePolygon, at_a_bridge_each_triangle_has_the_corners_of_its_own_side) {
    const std::vector<Vec3> corners = {Vec3(0, 0, 0), Vec3(4, 0, 0), Vec3(4, 4, 0), Vec3(0, 4, 0), Vec3(0, 0, 0),
                                       Vec3(1, 1, 0), Vec3(1, 3, 0), Vec3(3, 3, 0), Vec3(3, 1, 0), Vec3(1, 1, 0)};
    const auto triangles = triangulate_polygon(corners, welded(corners));
    ASSERT_TRUE(triangles);
    EXPECT_EQ(triangles->size(), 8u);
    for (const Triangle& t : *triangles) {
        Vec3 middle = Vec3::Zero();
        for (uint32_t c : t) middle += corners[c] / 3;
        for (uint32_t c : t) {
            if (c == 0 || c == 9) {
                EXPECT_GT(middle.x(), middle.y()) << "below the bridge";
            }
            if (c == 4 || c == 5) {
                EXPECT_LT(middle.x(), middle.y()) << "above the bridge";
            }
        }
    }
}

TEST(TriangulatePolygon, says_so_where_an_outline_is_not_simple) {
    const std::vector<std::vector<Vec3>> bad = {
        {Vec3(0, 0, 0), Vec3(1, 1, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)},                  // crosses itself
        {Vec3(0, 0, 0), Vec3(1, 1, 1), Vec3(3, 3, 3), Vec3(2, 2, 2)},                  // a line
        {Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(2, 2, 0), Vec3(1, 0, 0), Vec3(0, 2, 0)}};  // a corner on a side
    for (const std::vector<Vec3>& corners : bad) EXPECT_FALSE(triangulate_polygon(corners, welded(corners)));
    std::vector<Vec3> star;  // goes round twice, turning left at every corner
    for (int k = 0; k < 5; ++k) {
        const double angle = 0.8 * std::numbers::pi * k;
        star.push_back(Vec3(std::cos(angle), std::sin(angle), 0));
    }
    EXPECT_FALSE(triangulate_polygon(star, welded(star)));
}

}  // namespace
}  // namespace sunder
