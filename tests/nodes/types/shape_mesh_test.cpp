#include "nodes/types/shape_mesh.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

namespace sunder {
namespace {

double volume(const TriMesh& m) {
    double six = 0;
    for (const Triangle& t : m.triangles) six += m.positions[t[0]].dot(m.positions[t[1]].cross(m.positions[t[2]]));
    return six / 6;
}

void expect_closed_with_normals_outwards(const TriMesh& m) {
    std::multiset<std::pair<uint32_t, uint32_t>> edges;
    for (size_t t = 0; t < m.triangles.size(); ++t) {
        const Triangle& v = m.triangles[t];
        const Vec3 flat = (m.positions[v[1]] - m.positions[v[0]]).cross(m.positions[v[2]] - m.positions[v[0]]);
        EXPECT_GT(flat.norm(), 0);
        for (size_t k = 0; k < 3; ++k) {
            edges.insert({v[k], v[(k + 1) % 3]});
            EXPECT_GT(flat.dot(m.corner_normals[3 * t + k].cast<double>()), 0);
            EXPECT_NEAR(m.corner_normals[3 * t + k].norm(), 1, 1e-6);
        }
    }
    for (const auto& [a, b] : edges) {
        EXPECT_EQ(edges.count({a, b}), 1u);
        EXPECT_EQ(edges.count({b, a}), 1u);
    }
}

TEST(ShapeMesh, of_a_sphere_lies_close_below_its_surface) {
    Shape shape;
    shape.kind = ShapeKind::sphere, shape.radius = 2;
    const TriMesh m = shape_mesh(shape, 1);
    expect_closed_with_normals_outwards(m);
    for (const Triangle& t : m.triangles) {
        const double middle = ((m.positions[t[0]] + m.positions[t[1]] + m.positions[t[2]]) / 3).norm();
        EXPECT_TRUE(middle > 2 * (1 - 0.015) && middle < 2) << middle;
    }
}

TEST(ShapeMesh, of_a_capsule_is_a_cylinder_between_two_caps) {
    Shape shape;
    shape.kind = ShapeKind::capsule, shape.radius = 0.5, shape.half_height = 1;
    const TriMesh m = shape_mesh(shape, 1);
    expect_closed_with_normals_outwards(m);
    const double exact = std::numbers::pi * (0.25 * 2 + 4.0 / 3 * 0.125);
    EXPECT_LT(volume(m), exact);
    EXPECT_GT(volume(m), 0.975 * exact);  // chords of 32 around and 16 up
    double top = 0;
    for (const Vec3& p : m.positions) top = std::max(top, p.z());
    EXPECT_DOUBLE_EQ(top, 1.5);
}

TEST(ShapeMesh, of_a_box_is_exact) {
    Shape shape;
    shape.kind = ShapeKind::box, shape.half_extents = {1, 2, 3};
    const TriMesh m = shape_mesh(shape, 1);
    expect_closed_with_normals_outwards(m);
    EXPECT_DOUBLE_EQ(volume(m), 48);
    EXPECT_EQ(m.triangles.size(), 12u);
}

TEST(ShapeMesh, of_a_plane_is_a_square_that_looks_up) {
    Shape shape;
    shape.kind = ShapeKind::plane;
    const TriMesh m = shape_mesh(shape, 6);
    ASSERT_EQ(m.triangles.size(), 2u);
    for (const Vec3& p : m.positions) EXPECT_EQ(p.cwiseAbs(), Vec3(3, 3, 0));
    for (const Vec3f& n : m.corner_normals) EXPECT_EQ(n, Vec3f(0, 0, 1));
    shape.kind = ShapeKind::mesh;
    EXPECT_TRUE(shape_mesh(shape, 6).triangles.empty());
}

}  // namespace
}  // namespace sunder
