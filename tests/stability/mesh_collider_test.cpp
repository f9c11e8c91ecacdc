// Mesh colliders where distance grids mislead: rest in hollows, slopes, thin walls, stacks, many pieces on rough
// ground.
#include <gtest/gtest.h>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/level_set.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "solver/collision/grid_distance.h"
#include "tests/support/energy.h"
#include "tests/support/lattice_scene.h"
#include "tests/support/solids.h"

namespace sunder {
namespace {

Collider mesh_collider(const TriMesh& mesh, const LevelSetSettings& settings) {
    std::vector<std::string> warnings;
    auto grid = make_level_set(mesh, settings, "collider", warnings);
    EXPECT_TRUE(grid) << (grid ? "" : grid.error().text());
    Collider c;
    c.name = "mesh";
    c.grid = std::make_shared<const SignedDistanceGrid>(grid.take());
    c.shape.kind = ShapeKind::mesh;
    c.shape.grid = c.grid.get();
    return c;
}

Collider floor_plane() {
    Collider c;
    c.name = "floor";
    c.shape.kind = ShapeKind::plane;
    return c;
}

RigidBody solid(ShapeKind kind, const Vec3& position, double mass, double half) {
    RigidBody b;
    b.name = "solid";
    b.shape.kind = kind;
    b.shape.radius = half;
    b.shape.half_extents = Vec3::Constant(half);
    b.mass = mass;
    b.pose.position = position;
    return b;
}

struct Shot {
    Scene scene;
    Material material;
    SolverSettings settings;
    DrivenPose pose;
    std::unique_ptr<Solver> solver;
    FrameState state;
    Vec3 gravity = Vec3(0, 0, -9.81);

    explicit Shot(Collider collider) {
        scene.colliders.push_back(std::move(collider));
        material.youngs_modulus = 1e6;
    }
    void start() {
        solver = test::make_solver(scene);
        state = solver->initial_state(std::vector<Material>(scene.bodies.size(), material));
    }
    void frames(int n) {
        FrameInput in = test::quiet_input(scene, material);
        in.gravity = gravity;
        in.colliders[0] = pose;
        for (int k = 0; k < n; ++k) test::advance(*solver, in, settings, state);
    }
    double energy() const { return test::energy(solver->scene(), material, gravity, state).total(); }
    double fastest() const {
        double v = 0;
        for (const Vec3& x : state.velocity) v = std::max(v, x.norm());
        for (const RigidBodyState& r : state.rigid_bodies) v = std::max(v, r.velocity.norm());
        return v;
    }
    /// How deep particles are in the mesh, m; negative: how near they are.
    double deepest() const {
        double depth = -1e300;
        const SimulationMesh& rest = scene.rest;
        for (size_t i = 0; i < state.n_particles(); ++i) {
            const Ellipsoid e{state.position[i], state.orientation[i].toRotationMatrix(), rest.radii[i]};
            depth = std::max(depth, -ellipsoid_grid_contacts(e, *scene.colliders[0].grid, pose.end).points[0].gap);
        }
        return depth;
    }
};

TEST(MeshCollider, a_ball_comes_to_rest_at_the_bottom_of_a_bowl) {
    const TriMesh bowl = test::terrain(2, 64, -0.3, [](double x, double y) { return 0.5 * (x * x + y * y); });
    Shot shot(mesh_collider(bowl, {.resolution = 64}));
    shot.scene.rigid_bodies.push_back(solid(ShapeKind::sphere, {0.5, 0.1, 0.4}, 1, 0.15));
    shot.scene.colliders[0].friction = 1;
    shot.settings.damping = 2;
    shot.start();
    shot.frames(24 * 10);
    const Vec3 x = shot.state.rigid_bodies[0].position;
    std::printf("bowl: ends at (%.4f %.4f %.4f), %.1e m/s\n", x.x(), x.y(), x.z(), shot.fastest());
    EXPECT_LE(x.head<2>().norm(), 0.02);
    EXPECT_NEAR(x.z(), 0.15, 0.003);  // a tenth of a voxel
    EXPECT_LE(shot.fastest(), 0.02);
}

TEST(MeshCollider, slopes_hold_below_the_angle_of_friction_and_not_above) {
    // tan of the slope is 0.4; the box's friction with it is the root of both.
    const TriMesh slope = test::terrain(4, 1, -1.5, [](double x, double) { return -0.4 * x; });
    for (const double friction : {0.38, 0.42}) {
        Shot shot(mesh_collider(slope, {.resolution = 100}));
        shot.scene.colliders[0].friction = friction;
        const Quat tilt(Eigen::AngleAxisd(std::atan(0.4), Vec3::UnitY()));
        RigidBody body = solid(ShapeKind::box, tilt * Vec3(-0.5, 0, 0.1), 1, 0.1);
        body.pose.orientation = tilt;
        body.friction = friction;
        shot.scene.rigid_bodies.push_back(body);
        shot.start();
        const Vec3 start = body.pose.position;
        shot.frames(24);
        const double way = (shot.state.rigid_bodies[0].position - start).norm();
        const double angle = std::atan(0.4);
        const double free = 0.5 * 9.81 * (std::sin(angle) - friction * std::cos(angle));  // 1 s from rest
        std::printf("slope 0.4, friction %.2f: slid %.4f m of %.4f\n", friction, way, std::max(0.0, free));
        if (friction > 0.4)
            EXPECT_LE(way, 0.002);
        else
            EXPECT_NEAR(way, free, 0.1 * free + 0.002);
    }
}

TEST(MeshCollider, a_stack_on_a_mesh_stands_as_on_a_plane) {
    double height[2][3];
    for (int k = 0; k < 2; ++k) {
        Shot shot(k == 0 ? floor_plane() : mesh_collider(test::block({-1, -1, -0.4}, {1, 1, 0}), {.resolution = 50}));
        for (int b = 0; b < 3; ++b)
            shot.scene.rigid_bodies.push_back(solid(ShapeKind::box, {0.03, 0.02, 0.1 + 0.2 * b}, 1, 0.1));
        shot.start();
        shot.frames(48);
        for (int b = 0; b < 3; ++b) height[k][b] = shot.state.rigid_bodies[b].position.z();
        EXPECT_LE(shot.fastest(), 1e-2);
    }
    for (int b = 0; b < 3; ++b) {
        std::printf("box %d: %.6f m on a plane, %.6f on a mesh\n", b, height[0][b], height[1][b]);
        EXPECT_NEAR(height[0][b], height[1][b], 1e-5);  // a flat face is flat in the grid too
    }
}

TEST(MeshCollider, a_bunny_that_falls_on_a_torus_comes_to_rest_and_is_nowhere_in_it) {
    Shot shot(mesh_collider(test::ring(0.5, 0.2, 64, 32), {.resolution = 80}));
    const auto bunny = read_mesh(SUNDER_TEST_DATA "/bunny.obj");
    ASSERT_TRUE(bunny);
    Aabb box;
    for (const Vec3& p : bunny->positions) box.extend(p);
    TriMesh unit = *bunny;
    for (Vec3& p : unit.positions) p = (p - 0.5 * (box.min + box.max)) / (box.max - box.min).maxCoeff();
    PrefractureSettings cut;
    cut.pieces = 40;
    const auto fragments = prefracture(unit, cut, "bunny");
    ASSERT_TRUE(fragments) << fragments.error().text();
    auto mesh = build_simulation_mesh(*fragments, {});
    ASSERT_TRUE(mesh) << mesh.error().text();
    mesh->hull_offset.clear(), mesh->hull_point.clear();  // ellipsoids touch, and not what they stand for
    test::add_body(shot.scene, *mesh, {Vec3(0.1, 0, 0.9), Quat::Identity()});
    shot.settings.damping = 1;
    shot.start();
    double deepest = -1e300;
    for (int k = 0; k < 72; ++k) {
        shot.frames(1);
        deepest = std::max(deepest, shot.deepest());
    }
    const double last = shot.deepest();
    double size = 0;
    for (const Vec3& r : shot.scene.rest.radii) size += r.minCoeff() / double(shot.scene.rest.n_particles());
    const Vec3 middle = shot.state.position[0];
    std::printf(
        "bunny on a torus: %.1e m/s, deepest %.4f m in the fall, %.5f at rest (particles of %.3f m), at %.2f m\n",
        shot.fastest(), deepest, last, size, middle.z());
    EXPECT_LE(shot.fastest(), 0.05);
    EXPECT_LE(std::abs(last), 0.02 * size) << "touches, within the margin of contacts";
    EXPECT_GT(middle.z(), -0.3);
}

TEST(MeshCollider, a_moving_mesh_carries_what_lies_on_it) {
    Shot shot(mesh_collider(test::block({-1, -1, -0.2}, {1, 1, 0}), {.resolution = 40}));
    shot.scene.colliders[0].friction = 1;
    RigidBody box = solid(ShapeKind::box, {0, 0, 0.1}, 1, 0.1);
    box.friction = 1;
    box.velocity = Vec3(0.5, 0, 0);
    shot.scene.rigid_bodies.push_back(box);
    shot.start();
    const double step = 0.5 / 24;
    for (int k = 0; k < 24; ++k) {
        shot.pose.begin.position = Vec3(k * step, 0, 0);
        shot.pose.end.position = Vec3((k + 1) * step, 0, 0);
        shot.frames(1);
    }
    EXPECT_NEAR(shot.state.rigid_bodies[0].position.x(), 0.5, 2e-3);
    EXPECT_NEAR(shot.state.rigid_bodies[0].velocity.x(), 0.5, 1e-2);
}

TEST(MeshCollider, a_fast_wall_takes_what_it_hits_along) {
    // A wall of two voxels at 40 m/s: 0.2 m a substep against fragments of 0.025 m.
    Shot shot(mesh_collider(test::block({-0.02, -1, -1}, {0.02, 1, 1}), {.voxel_size = 0.02}));
    test::add_body(shot.scene, test::lattice_mesh({{2, 2, 2}, 0.05, 6, 1000, {}}), {Vec3(0.5, 0, 0), Quat::Identity()});
    shot.gravity.setZero();
    shot.start();
    for (int k = 0; k < 3; ++k) {
        shot.pose.begin.position = Vec3(k * 40.0 / 24, 0, 0);
        shot.pose.end.position = Vec3((k + 1) * 40.0 / 24, 0, 0);
        shot.frames(1);
    }
    for (const Vec3& x : shot.state.position) EXPECT_GT(x.x(), 5.0) << "left behind";
}

TEST(MeshCollider, fragments_on_rough_ground_gain_no_energy) {
    const TriMesh ground =
        test::terrain(2, 24, -0.4, [](double x, double y) { return 0.06 * std::sin(9 * x) * std::cos(7 * y); });
    Shot shot(mesh_collider(ground, {.resolution = 80}));
    test::add_body(shot.scene, test::lattice_mesh({{10, 3, 3}, 0.05, 6, 1000, {}}),
                   {Vec3(0, 0, 0.3), Quat(Eigen::AngleAxisd(0.3, Vec3(1, 2, 0).normalized()))}, Vec3(0, 0, -6));
    shot.material.youngs_modulus = 1e7;
    shot.material.toughness = 0.005;
    shot.start();
    const double start = shot.energy();
    double last = start, rise = 0, highest = -1e300, deepest = -1e300;
    for (int k = 0; k < 24; ++k) {
        shot.frames(1);
        rise = std::max(rise, shot.energy() - last);
        last = shot.energy();
        highest = std::max(highest, last - start);
        deepest = std::max(deepest, shot.deepest());
    }
    std::printf(
        "rough ground: %zu of %zu edges broken, energy %.1f J to %.1f J, rise of a frame %.2e J, deepest %.4f m\n",
        test::count_broken(shot.state), shot.state.edge_intact.size(), start, last, rise, deepest);
    EXPECT_GT(test::count_broken(shot.state), 20u);
    EXPECT_LE(highest, 0);
    EXPECT_LE(rise, 0.005 * std::abs(start));
    size_t over = 0;  // the ground; what flies farther falls
    for (const Vec3& x : shot.state.position) {
        if (std::max(std::abs(x.x()), std::abs(x.y())) > 1) continue;
        ++over;
        EXPECT_GT(x.z(), -0.15) << "fell through";
    }
    EXPECT_GT(over, 50u);
}

TEST(MeshCollider, the_same_bits_for_any_number_of_threads) {
    const Collider collider = mesh_collider(test::ring(0.5, 0.2, 48, 24), {.resolution = 50});
    uint64_t hash[2];
    for (int k = 0; k < 2; ++k) {
        Shot shot(collider);
        test::add_body(shot.scene, test::lattice_mesh({{12, 12, 4}, 0.05, 6, 1000, {}}),
                       {Vec3(0.2, 0, 0.25), Quat::Identity()}, Vec3(0, 0, -3));
        shot.material.toughness = 0.05;
        shot.solver = test::make_solver(shot.scene, k == 0 ? 1 : 4);
        shot.state = shot.solver->initial_state({shot.material});
        shot.frames(5);
        hash[k] = state_hash(shot.state);
    }
    EXPECT_EQ(hash[0], hash[1]);
}

}  // namespace
}  // namespace sunder
