#include "fracture_tools/fragments/fragment_hulls.h"

#include <gtest/gtest.h>

#include <random>

#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "fracture_tools/lattice.h"

namespace sunder {
namespace {

double support(std::span<const Vec3f> hull, const Vec3& direction) {
    double farthest = -1e300;
    for (const Vec3f& p : hull) farthest = std::max(farthest, direction.dot(p.cast<double>()));
    return farthest;
}

TEST(FragmentHulls, a_box_is_its_corners) {
    LatticeSettings settings;
    settings.size = Vec3(2, 2, 1);
    settings.cells = {2, 2, 1};
    const auto mesh = build_simulation_mesh(make_lattice(settings, "lattice").take(), {});
    ASSERT_TRUE(mesh);
    for (size_t i = 0; i < 4; ++i) {
        ASSERT_EQ(mesh->hull(i).size(), 8u);
        for (const Vec3f& p : mesh->hull(i)) EXPECT_EQ(p.cwiseAbs(), Vec3f(0.5f, 0.5f, 0.5f));
    }
}

TEST(FragmentHulls, supports_are_those_of_all_vertices_within_three_per_cent) {
    std::mt19937_64 rng(1);
    std::normal_distribution<double> normal;
    const auto on_ball = [&] { return Vec3(normal(rng), normal(rng), normal(rng)).normalized(); };
    FragmentSet set;
    for (uint32_t t = 0; t < 20000; ++t) {
        for (int k = 0; k < 3; ++k) set.vertices.push_back(on_ball());
        set.outer_triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    set.fragments.resize(1);
    set.fragments[0].outer_end = 20000;
    SimulationMesh mesh;
    mesh.rest_position = {Vec3::Zero()};
    find_hulls(set, mesh);
    EXPECT_LE(mesh.hull(0).size(), 128u);
    for (int k = 0; k < 1000; ++k) {
        const double s = support(mesh.hull(0), on_ball());
        EXPECT_GE(s, 0.97);  // the widest gap of the directions is 0.24 rad from the nearest
        EXPECT_LE(s, 1 + 1e-6);
    }
}

TEST(FragmentHulls, bodies_are_appended_with_their_turn_and_without_hulls_there_are_none) {
    LatticeSettings settings;
    settings.cells = {1, 1, 1};
    const auto mesh = build_simulation_mesh(make_lattice(settings, "lattice").take(), {});
    ASSERT_TRUE(mesh);
    SimulationMesh plain = *mesh, scene;
    plain.hull_offset.clear(), plain.hull_point.clear();
    append_body(scene, plain, {});
    EXPECT_TRUE(scene.hull_offset.empty());
    append_body(scene, *mesh, {Vec3(5, 0, 0), Quat(Eigen::AngleAxisd(0.5, Vec3::UnitX()))});
    append_body(scene, plain, {});
    EXPECT_TRUE(scene.hull(0).empty());
    EXPECT_TRUE(scene.hull(2).empty());
    ASSERT_EQ(scene.hull(1).size(), 8u);
    const double half = settings.size.x() / 2;
    EXPECT_NEAR(support(scene.hull(1), Vec3::UnitX()), half, 1e-6);
    EXPECT_NEAR(support(scene.hull(1), Vec3::UnitZ()), half * (std::cos(0.5) + std::sin(0.5)), 1e-6);
}

}  // namespace
}  // namespace sunder
