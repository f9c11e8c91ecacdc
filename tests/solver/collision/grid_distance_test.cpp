#include "solver/collision/grid_distance.h"

#include <gtest/gtest.h>

#include <functional>

#include "fracture_tools/level_set.h"
#include "solver/collision/grid_contacts.h"
#include "tests/solver/collision/collision_cases.h"
#include "tests/support/solids.h"

namespace sunder {
namespace {

SignedDistanceGrid grid_of(const TriMesh& mesh, int resolution) {
    std::vector<std::string> warnings;
    auto grid = make_level_set(mesh, {.resolution = resolution}, "mesh", warnings);
    EXPECT_TRUE(grid) << (grid ? "" : grid.error().text());
    return grid ? grid.take() : SignedDistanceGrid();
}

PlacedShape placed(const SignedDistanceGrid& grid, const Pose& pose = {}) {
    PlacedShape s;
    s.shape.kind = ShapeKind::mesh;
    s.shape.grid = &grid;
    s.pose = pose;
    return s;
}

Ellipsoid ellipsoid(const Vec3& center, const Vec3& radii, const Mat3& axes = Mat3::Identity()) {
    return {center, axes, radii};
}

double box_distance(const Vec3& x, const Vec3& half) {
    const Vec3 q = x.cwiseAbs() - half;
    return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

struct Solid {
    const char* name;
    TriMesh mesh;
    std::function<double(const Vec3&)> distance;
    double order;  // of the distance's error near the surface, at least; facets of the mesh take some of 2
};

std::vector<Solid> solids() {
    const Vec3 half(0.5, 0.3, 0.2);
    return {{"sphere", test::ball(0.5, 6), [](const Vec3& x) { return x.norm() - 0.5; }, 1.5},
            {"torus", test::ring(0.35, 0.15, 192, 96),
             [](const Vec3& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.35, x.z()) - 0.15; }, 1.5},
            {"box", test::block(-half, half), [=](const Vec3& x) { return box_distance(x, half); }, 1.0}};
}

TEST(GridDistance, converges_to_the_exact_distance) {
    for (const Solid& solid : solids()) {
        double before = 0, coarsest = 0;
        for (const int resolution : {16, 32, 64}) {
            const SignedDistanceGrid grid = grid_of(solid.mesh, resolution);
            auto rng = generator(7);
            double most = 0, tilt = 0, sum = 0;
            int n = 0;
            for (int k = 0; k < 40000; ++k) {
                const Vec3 x = uniform3(rng, -0.55, 0.55);
                const double exact = solid.distance(x);
                if (std::abs(exact) > 0.5 * grid.voxel_size) continue;  // where contacts are
                const GridSample s = sample(grid, x);
                most = std::max(most, std::abs(s.distance - exact));
                sum += std::abs(s.distance - exact);
                ++n;
                Vec3 slope;
                for (int i = 0; i < 3; ++i)
                    slope[i] =
                        (solid.distance(x + 1e-6 * Vec3::Unit(i)) - solid.distance(x - 1e-6 * Vec3::Unit(i))) / 2e-6;
                tilt = std::max(tilt, std::acos(std::min(1.0, slope.dot(s.gradient) / s.gradient.norm())));
            }
            std::printf("%-6s %3d: error mean %.1e, most %.1e m (%.3f voxels, order %.1f), normal within %.1f deg\n",
                        solid.name, resolution, sum / n, most, most / grid.voxel_size,
                        before > 0 ? std::log2(before / most) : 0.0, tilt * 180 / M_PI);
            if (resolution == 16) coarsest = most;
            before = most;
        }
        EXPECT_GE(std::log2(coarsest / before) / 2, solid.order) << solid.name;
    }
}

TEST(GridDistance, beyond_the_grid_it_stays_below_the_distance_and_continues_it) {
    const Solid torus = solids()[1];
    const SignedDistanceGrid grid = grid_of(torus.mesh, 48);
    auto rng = generator(8);
    int n_beyond = 0, n_kinks = 0;
    const Vec3 last = grid.node(grid.nodes[0] - 1, grid.nodes[1] - 1, grid.nodes[2] - 1);
    for (int k = 0; k < 5000; ++k) {
        const Vec3 x = uniform3(rng, -3, 3);
        const GridSample s = sample(grid, x);
        EXPECT_LE(s.distance, torus.distance(x) + grid.voxel_size);
        EXPECT_GE(s.distance, 0.5 * std::max(torus.distance(x), 0.0) - (torus.distance(x) < 0 ? 0.2 : grid.voxel_size));
        Vec3 slope;
        for (int i = 0; i < 3; ++i)
            slope[i] =
                (sample(grid, x + 1e-6 * Vec3::Unit(i)).distance - sample(grid, x - 1e-6 * Vec3::Unit(i)).distance) /
                2e-6;
        const bool beyond = ((x - last).array() > 0).any() || ((x - grid.origin).array() < 0).any();
        n_beyond += beyond;
        n_kinks += beyond && (slope - s.gradient).norm() > 1e-4;  // where the nearest cell of the grid changes
    }
    EXPECT_GT(n_beyond, 4000);
    EXPECT_LE(n_kinks, 5);
}

TEST(GridContacts, an_ellipsoid_on_a_flat_face_is_as_on_a_plane) {
    const SignedDistanceGrid grid = grid_of(test::block({-1, -1, -1}, {1, 1, 0}), 40);
    auto rng = generator(9);
    for (int k = 0; k < 500; ++k) {
        const Pose pose = random_pose(rng, 3);
        Ellipsoid a = random_ellipsoid(rng, 0, 5);
        a.radii *= 0.1;
        a.center = pose.apply(Vec3(uniform(rng, -0.4, 0.4), uniform(rng, -0.4, 0.4), uniform(rng, 0.05, 0.3)));
        PlacedShape floor{plane(), pose};
        const Separation exact = ellipsoid_shape_distance(a, floor);
        if (exact.gap < -0.02 || exact.gap > 0.1) continue;  // beyond the grid it is a lower bound
        const Manifold m = ellipsoid_grid_contacts(a, grid, pose);
        ASSERT_EQ(m.count, 1);
        expect_whole(m.points[0], 4);
        EXPECT_NEAR(m.points[0].gap, exact.gap, 1e-6);
        EXPECT_NEAR(m.points[0].normal.dot(exact.normal), 1, 1e-6);
        EXPECT_LE((m.points[0].point_a - exact.point_a).norm(), 1e-3);
    }
}

TEST(GridContacts, an_ellipsoid_on_a_ball_is_as_on_a_sphere) {
    const SignedDistanceGrid grid = grid_of(test::ball(0.5, 5), 48);
    auto rng = generator(10);
    double most = 0;
    for (int k = 0; k < 1000; ++k) {
        Ellipsoid a = random_ellipsoid(rng, 0, 4);
        a.radii *= std::exp(uniform(rng, -3, 0.5));  // 0.05 .. 1.6 times the ball's radius
        a.center = random_direction(rng) * (0.5 + uniform(rng, 0.5, 1.5) * a.radii.maxCoeff());
        const Separation exact = ellipsoid_shape_distance(a, {sphere(0.5), {}});
        if (std::abs(exact.gap) > 0.02) continue;
        const Manifold m = ellipsoid_grid_contacts(a, grid, {});
        most = std::max(most, std::abs(m.points[0].gap - exact.gap));
        EXPECT_GT(m.points[0].normal.dot(exact.normal), 0.97) << a.radii.transpose();
    }
    std::printf("ellipsoids on a ball of 48 voxels: gap within %.3f voxels\n", most / grid.voxel_size);
    EXPECT_LE(most, 0.1 * grid.voxel_size);
}

TEST(GridContacts, a_ball_in_a_groove_touches_both_sides) {
    const TriMesh mesh = test::terrain(2, 64, -0.5, [](double x, double) { return std::abs(x); });
    const SignedDistanceGrid grid = grid_of(mesh, 60);
    const double r = 0.2, height = r * std::sqrt(2.0);
    const Manifold m = ellipsoid_grid_contacts(ellipsoid({0, 0, height}, Vec3::Constant(r)), grid, {});
    ASSERT_EQ(m.count, 2);
    for (int k = 0; k < 2; ++k) {
        EXPECT_NEAR(m.points[k].gap, 0, 0.1 * grid.voxel_size);
        EXPECT_NEAR(m.points[k].normal.z(), std::sqrt(0.5), 0.05);
    }
    EXPECT_LT(m.points[0].normal.x() * m.points[1].normal.x(), 0);
}

TEST(GridContacts, deep_inside_and_through_a_wall_the_way_leads_back) {
    const SignedDistanceGrid cube = grid_of(test::block(Vec3::Constant(-0.5), Vec3::Constant(0.5)), 50);
    const Manifold deep = ellipsoid_grid_contacts(ellipsoid({0.3, 0.02, 0.01}, {0.1, 0.05, 0.05}), cube, {});
    ASSERT_EQ(deep.count, 1);
    EXPECT_GT(deep.points[0].normal.x(), 0.99);
    EXPECT_NEAR(deep.points[0].gap, -0.3, 0.01);
    // Exactly in the middle no way is shorter than the others; any will do.
    expect_whole(ellipsoid_grid_contacts(ellipsoid(Vec3::Zero(), Vec3::Constant(0.1)), cube, {}).points[0], 1);

    const SignedDistanceGrid wall = grid_of(test::block({-0.5, -0.5, -0.02}, {0.5, 0.5, 0.02}), 50);  // two voxels
    for (const double through : {0.01, 0.05, 0.1, 0.19}) {
        const Manifold m = ellipsoid_grid_contacts(ellipsoid({0.01, 0, 0.22 - through}, Vec3::Constant(0.2)), wall, {});
        ASSERT_GE(m.count, 1);
        EXPECT_GT(m.points[0].normal.z(), 0.99) << through;
        EXPECT_NEAR(m.points[0].gap, -through, 0.005) << through;
        PlacedShape box_above{box(Vec3::Constant(0.2)), {Vec3(0.01, 0, 0.22 - through), Quat::Identity()}};
        const Manifold corners = rigid_grid_contacts(box_above, wall, {}, 1);
        ASSERT_GE(corners.count, 4);
        EXPECT_GT(corners.points[0].normal.z(), 0.99) << through;
        EXPECT_NEAR(corners.least_gap(), -through, 0.005) << through;
    }
}

TEST(GridContacts, a_box_lies_on_its_corners_and_on_what_bulges_into_its_face) {
    const SignedDistanceGrid floor = grid_of(test::block({-1, -1, -0.5}, {1, 1, 0}), 60);
    const PlacedShape a{box(Vec3(0.2, 0.1, 0.1)), {Vec3(0.1, 0, 0.099), Quat(Eigen::AngleAxisd(0.3, Vec3::UnitZ()))}};
    const Manifold flat = rigid_grid_contacts(a, floor, {}, 0.01);
    ASSERT_EQ(flat.count, 4);
    for (int k = 0; k < 4; ++k) {
        EXPECT_NEAR(flat.points[k].gap, -0.001, 1e-6);
        EXPECT_NEAR(flat.points[k].normal.z(), 1, 1e-6);
    }
    // Over the edge of a step: two corners hang in the air, the step's edge bears the face.
    const SignedDistanceGrid step = grid_of(test::block({-1, -1, -0.5}, {0.15, 1, 0}), 60);
    const PlacedShape over{box(Vec3(0.2, 0.1, 0.1)), {Vec3(0.1, 0, 0.0995), Quat::Identity()}};
    const Manifold edge = rigid_grid_contacts(over, step, {}, 0.01);
    double farthest = -1;
    for (int k = 0; k < edge.count; ++k) {
        EXPECT_GT(edge.points[k].normal.z(), 0.99) << edge.points[k].point_a.transpose();
        farthest = std::max(farthest, edge.points[k].point_a.x());
    }
    EXPECT_NEAR(farthest, 0.15, 2 * step.voxel_size) << "supported at the step's edge";
    // A ridge under the middle of a face.
    const SignedDistanceGrid ridge =
        grid_of(test::terrain(2, 40, -1.5, [](double x, double) { return -std::abs(x); }), 60);
    const PlacedShape plank{box(Vec3(0.4, 0.3, 0.05)), {Vec3(0.05, 0, 0.05), Quat::Identity()}};
    const Manifold line = rigid_grid_contacts(plank, ridge, {}, 0.02);
    ASSERT_GE(line.count, 2);
    double low = 1, high = -1;
    for (int k = 0; k < line.count; ++k) {
        EXPECT_NEAR(line.points[k].point_a.x(), 0, ridge.voxel_size);
        EXPECT_GT(line.points[k].normal.z(), 0.99);
        low = std::min(low, line.points[k].point_a.y());
        high = std::max(high, line.points[k].point_a.y());
    }
    EXPECT_LT(low, -0.2);
    EXPECT_GT(high, 0.2);
}

// A wall of two voxels, however it lies in the grid, and however fast the particle.
TEST(GridContacts, nothing_passes_a_wall_of_two_voxels) {
    auto rng = generator(11);
    int passed = 0, shots = 0;
    for (int wall = 0; wall < 6; ++wall) {
        const Mat3 turn = wall == 0 ? Mat3(Mat3::Identity()) : random_axes(rng);
        TriMesh mesh = test::block({-1, -1, -0.02}, {1, 1, 0.02});
        for (Vec3& p : mesh.positions) p = turn * p;
        std::vector<std::string> warnings;
        const auto grid = make_level_set(mesh, {.voxel_size = 0.02}, "wall", warnings);
        ASSERT_TRUE(grid);
        for (int k = 0; k < 400; ++k) {
            Ellipsoid a = random_ellipsoid(rng, 0, 3);
            a.radii *= uniform(rng, 0.005, 0.1);
            const Vec3 from(uniform(rng, -0.5, 0.5), uniform(rng, -0.5, 0.5), 0.02 + 1.01 * support(a, turn.col(2)));
            a.center = turn * from;
            const double depth = std::exp(uniform(rng, -3, 1.5));  // 0.05 .. 4.5 m in a substep
            const Vec3 shift = turn * Vec3(uniform(rng, -0.4, 0.4) * depth, uniform(rng, -0.4, 0.4) * depth, -depth);
            std::vector<Separation> found;
            grid_contacts(a, placed(*grid), shift, 1e-4, found);
            ++shots;
            const Vec3 hit = turn.transpose() * (a.center + shift * (from.z() / depth));
            if (hit.head<2>().cwiseAbs().maxCoeff() > 0.8) continue;  // past the wall's side
            const bool held = std::ranges::any_of(found, [&](const Separation& s) {
                return s.normal.dot(turn.col(2)) > 0.95 && std::abs(s.gap) < a.radii.maxCoeff();
            });
            passed += !held;
        }
    }
    std::printf("%d of %d shots passed\n", passed, shots);
    EXPECT_EQ(passed, 0);
}

TEST(GridContacts, the_second_wall_of_a_corner_is_seen_too) {
    TriMesh mesh = test::terrain(2, 1, -0.04, [](double, double) { return 0.0; });
    const TriMesh side = test::block({0.5, -1, 0.0}, {0.54, 1, 1});
    const uint32_t first = uint32_t(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), side.positions.begin(), side.positions.end());
    for (Triangle t : side.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    std::vector<std::string> warnings;
    const auto grid = make_level_set(mesh, {.voxel_size = 0.02}, "corner", warnings);
    ASSERT_TRUE(grid) << grid.error().text();
    const Ellipsoid a = ellipsoid({0.3, 0, 0.06}, Vec3::Constant(0.05));
    std::vector<Separation> found;
    grid_contacts(a, placed(*grid), Vec3(0.35, 0, -0.35), 1e-3, found);
    EXPECT_TRUE(std::ranges::any_of(found, [](const Separation& s) { return s.normal.z() > 0.95; }));
    EXPECT_TRUE(std::ranges::any_of(found, [](const Separation& s) {
        return s.normal.x() < -0.95 && std::abs(s.gap - 0.15) < 0.01;
    })) << "slides along the floor into the wall";
}

TEST(GridContacts, a_miss_is_a_miss) {
    const SignedDistanceGrid grid = grid_of(test::ball(0.5, 5), 48);
    std::vector<Separation> found;
    grid_contacts(ellipsoid({-2, 0.56, 0}, Vec3::Constant(0.05)), placed(grid), Vec3(4, 0.1, 0), 1e-3, found);
    EXPECT_TRUE(found.empty());
    grid_contacts(ellipsoid({-2, 0.3, 0}, Vec3::Constant(0.05)), placed(grid), Vec3(1, 0, 0), 1e-3, found);
    EXPECT_TRUE(found.empty());
    grid_contacts(ellipsoid({-2, 0.3, 0}, Vec3::Constant(0.05)), placed(grid), Vec3(4, 0, 0), 1e-3, found);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].normal.y(), 0.3 / 0.55, 0.02);
}

TEST(GridContacts, the_box_of_a_placed_mesh_holds_it) {
    const SignedDistanceGrid grid = grid_of(test::ball(0.3, 3, {1, 0, 0}), 16);
    auto rng = generator(12);
    const PlacedShape s = placed(grid, random_pose(rng, 2));
    const Aabb box = bounding_box(s);
    for (const Vec3& p : test::ball(0.3, 3, {1, 0, 0}).positions) {
        const Vec3 x = s.pose.apply(p);
        EXPECT_TRUE((x.array() >= box.min.array() - 1e-12).all() && (x.array() <= box.max.array() + 1e-12).all());
        EXPECT_LE(p.norm(), bounding_radius(s.shape) + 1e-12);
    }
}

}  // namespace
}  // namespace sunder
