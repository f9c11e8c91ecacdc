// Colliders that deform: what they sweep up, what they give, and that nothing depends on who works or where one begins.
#include <gtest/gtest.h>

#include "fracture_tools/level_set.h"
#include "solver/data/rotations.h"
#include "tests/support/lattice_scene.h"
#include "tests/support/solids.h"

namespace sunder {
namespace {

constexpr double kFrame = 1.0 / 24;  // s

using VertexOf = std::function<Vec3(const Vec3& rest, int frame)>;

struct Shot {
    TriMesh mesh;
    VertexOf where;
    Scene scene;
    Material material;
    SolverSettings settings;
    std::unique_ptr<Solver> solver;
    FrameInput input;
    FrameState state;
    int frame = 0;

    Shot(TriMesh collider, VertexOf of, Scene bodies, int threads = 1)
        : mesh(std::move(collider)), where(std::move(of)), scene(std::move(bodies)) {
        Collider c;
        c.name = "mesh", c.shape.kind = ShapeKind::mesh, c.tree = make_surface_tree(mesh, 0);
        scene.colliders.push_back(c);
        material.youngs_modulus = 1e6;
        solver = test::make_solver(scene, threads);
        input = test::quiet_input(scene, material, kFrame);
        input.colliders[0] = drive(0);
        state = solver->initial_state(input.materials);
    }
    std::vector<Vec3> at(int f) const {
        std::vector<Vec3> out;
        for (const Vec3& p : mesh.positions) out.push_back(where(p, f));
        return out;
    }
    DrivenPose drive(int f) const {
        return drive_of(std::make_shared<const MovingSurface>(move_surface(scene.colliders[0].tree, at(f), at(f + 1))));
    }
    void go_on(int frames) {
        for (int k = 0; k < frames; ++k, ++frame) {
            input.colliders[0] = drive(frame);
            test::advance(*solver, input, settings, state);
        }
    }
    Vec3 momentum() const {
        Vec3 sum = Vec3::Zero();
        for (size_t i = 0; i < state.n_particles(); ++i) sum += solver->scene().rest.mass[i] * state.velocity[i];
        return sum;
    }
};

// 5 x 5 x 5 fragments of 4 mm, loose.
Scene crumbs(double toughness_apart = 0.02) {
    Scene scene;
    for (int x = 0; x < 5; ++x)
        for (int y = 0; y < 5; ++y)
            for (int z = 0; z < 5; ++z)
                test::add_body(scene, test::lattice_mesh({.cells = {1, 1, 1}, .spacing = 0.004}),
                               {toughness_apart * Vec3(x - 2, y - 2, z), Quat::Identity()});
    return scene;
}

// Its middle goes at 10 m/s along z: 417 mm a frame, a hundred times what it is thick; its rim lags behind.
Vec3 bulging(const Vec3& p, int frame) {
    const double r2 = p.x() * p.x() + p.y() * p.y();
    return {p.x(), p.y(), p.z() - 0.05 + 10 * kFrame * frame * (1 - 0.8 * r2)};
}

TEST(deforming_collider, a_plate_at_10_m_per_s_pushes_all_of_a_heap_of_crumbs) {
    Shot shot(test::terrain(1, 12, -0.004, [](double, double) { return 0.0; }), bulging, crumbs());
    shot.go_on(3);
    for (size_t i = 0; i < shot.state.n_particles(); ++i) {
        const Vec3& x = shot.state.position[i];
        const double top = bulging(Vec3(x.x(), x.y(), 0), 3).z();
        EXPECT_GT(x.z(), top - 0.002) << "crumb " << i;  // half a crumb
        EXPECT_GT(shot.state.velocity[i].z(), 9) << "crumb " << i;
    }
}

TEST(deforming_collider, a_soft_body_at_rest_is_swept_up_whole) {
    Scene scene = test::lattice_scene({.cells = {8, 8, 8}, .spacing = 0.01, .neighbours = 26});
    Shot shot(test::terrain(1, 12, -0.004, [](double, double) { return 0.0; }), bulging, std::move(scene));
    shot.material.toughness = 0.01;
    shot.input.materials.assign(1, shot.material);
    shot.go_on(3);
    for (size_t i = 0; i < shot.state.n_particles(); ++i) {
        const Vec3& x = shot.state.position[i];
        EXPECT_GT(x.z(), bulging(Vec3(x.x(), x.y(), 0), 3).z() - 0.005) << "fragment " << i;
    }
}

// A paddle that turns by 12 degrees a frame about an axis beside it.
Pose turned(int frame) {
    const Vec3 axis(0, -0.5, 0);
    const Quat q = rotation_about(Vec3::UnitX(), 0.21 * frame);
    return {axis - q * axis, q};
}

struct Given {
    Vec3 momentum, middle;
};

// The same paddle, by its vertices or by keys: as a box, or as a grid.
Given paddled(bool by_vertices, bool by_grid) {
    const TriMesh mesh = test::block({-0.3, -0.5, -0.15}, {0.3, 0.5, -0.05});
    Scene bodies = test::lattice_scene({.cells = {4, 4, 4}, .spacing = 0.04, .neighbours = 26});
    Shot shot(
        mesh, [](const Vec3& p, int f) { return turned(f).apply(p); }, std::move(bodies));
    shot.material.friction = 0.3;
    shot.input.materials.assign(1, shot.material);
    if (!by_vertices) {
        Collider& c = shot.scene.colliders[0];
        c = {}, c.name = "mesh";
        if (by_grid) {
            std::vector<std::string> warnings;
            c.grid = std::make_shared<const SignedDistanceGrid>(
                make_level_set(mesh, {0.01, 100, 0}, "paddle", warnings).take());
            c.shape.kind = ShapeKind::mesh, c.shape.grid = c.grid.get();
        } else {
            c.shape.kind = ShapeKind::box, c.shape.half_extents = Vec3(0.3, 0.5, 0.05);
        }
        shot.solver = test::make_solver(shot.scene);
        shot.state = shot.solver->initial_state(shot.input.materials);
        for (; shot.frame < 6; ++shot.frame) {
            DrivenPose pose{turned(shot.frame), turned(shot.frame + 1)};
            pose.pivot = Vec3(0, -0.5, 0);
            const Pose center{Vec3(0, 0, -0.1), Quat::Identity()};
            if (!by_grid) {
                const auto placed = [&](const Pose& p) { return Pose{p.apply(center.position), p.orientation}; };
                pose = {placed(pose.begin), placed(pose.end)};
                pose.pivot = Vec3(0, -0.5, 0.1);
            }
            shot.input.colliders[0] = pose;
            test::advance(*shot.solver, shot.input, shot.settings, shot.state);
        }
    } else {
        shot.go_on(6);
    }
    Vec3 middle = Vec3::Zero();
    for (const Vec3& x : shot.state.position) middle += x / double(shot.state.n_particles());
    return {shot.momentum(), middle};
}

// Keys turn about the axis; vertices about their middle, whose way is a chord: 0.5 m (1 - cos 0.105) = 2.8 mm off the
// arc in the middle of a frame, of the 110 mm that it goes: so much of the momentum as that is of the way, twice for
// there and back.
TEST(deforming_collider, vertices_that_move_as_one_give_what_keys_give) {
    const Given box = paddled(false, false), grid = paddled(false, true), vertices = paddled(true, false);
    const double scale = box.momentum.norm(), way = box.middle.norm();
    EXPECT_GT(scale, 0.1);
    EXPECT_LT((vertices.momentum - box.momentum).norm(), 0.05 * scale)
        << "box " << box.momentum.transpose() << " grid " << grid.momentum.transpose() << " vertices "
        << vertices.momentum.transpose();
    EXPECT_LT((vertices.momentum - grid.momentum).norm(), 0.05 * scale);
    EXPECT_LT((vertices.middle - box.middle).norm(), 0.05 * way);
}

TEST(deforming_collider, straight_on_it_gives_the_same_speed_to_rounding_as_a_box) {
    const auto go = [](bool by_vertices) {
        const TriMesh mesh = test::block({-0.5, -0.5, -0.1}, {0.5, 0.5, -0.02});
        Scene bodies;
        RigidBody ball;
        ball.name = "ball", ball.shape.radius = 0.05, ball.mass = 1, ball.pose.position = Vec3(0.01, 0.02, 0.3);
        ball.restitution = 0.5;
        bodies.rigid_bodies = {ball};
        Shot shot(
            mesh, [](const Vec3& p, int f) -> Vec3 { return p + Vec3(0, 0, 0.1 * f); }, std::move(bodies));
        if (!by_vertices) {
            Collider& c = shot.scene.colliders[0];
            c = {}, c.shape.kind = ShapeKind::box, c.shape.half_extents = Vec3(0.5, 0.5, 0.04);
            shot.solver = test::make_solver(shot.scene);
            shot.state = shot.solver->initial_state(shot.input.materials);
            for (; shot.frame < 6; ++shot.frame) {
                const auto at = [&](int f) { return Pose{Vec3(0, 0, -0.06 + 0.1 * f), Quat::Identity()}; };
                shot.input.colliders[0] = {at(shot.frame), at(shot.frame + 1)};
                test::advance(*shot.solver, shot.input, shot.settings, shot.state);
            }
        } else {
            shot.go_on(6);
        }
        return shot.state.rigid_bodies[0];
    };
    const RigidBodyState box = go(false), vertices = go(true);
    EXPECT_GT(box.velocity.z(), 2.4);
    EXPECT_LT((vertices.velocity - box.velocity).norm(), 1e-9);
    EXPECT_LT((vertices.position - box.position).norm(), 1e-9);
}

TEST(deforming_collider, a_surface_that_swells_gives_its_own_speed) {
    // A balloon of 0.2 m that grows by 2 m/s under a plate of one fragment: it goes no slower than the surface.
    Scene bodies;
    RigidBody ball;
    ball.name = "ball", ball.shape.radius = 0.05, ball.mass = 1, ball.pose.position = Vec3(0, 0, 0.3);
    bodies.rigid_bodies = {ball};
    Shot shot(
        test::ball(0.2, 3), [](const Vec3& p, int f) -> Vec3 { return p * (1 + 2 * kFrame / 0.2 * f); },
        std::move(bodies));
    shot.go_on(4);
    EXPECT_NEAR(shot.state.rigid_bodies[0].velocity.z(), 2, 0.02);
    EXPECT_LT(shot.state.rigid_bodies[0].velocity.head<2>().norm(), 0.05);
}

TEST(deforming_collider, any_number_of_threads_gives_the_same_bits_and_so_does_going_on_from_a_state) {
    const auto after = [](int threads, bool resumes) {
        Shot shot(test::terrain(1, 12, -0.004, [](double, double) { return 0.0; }), bulging, crumbs(0.006), threads);
        shot.go_on(1);
        if (resumes) {
            const FrameState kept = shot.state;
            shot.solver = test::make_solver(shot.scene, threads);
            shot.state = kept;
        }
        shot.go_on(2);
        return shot.state;
    };
    const FrameState one = after(1, false), three = after(3, false), resumed = after(1, true);
    EXPECT_EQ(state_hash(one), state_hash(three));
    EXPECT_EQ(state_hash(one), state_hash(resumed));
}

TEST(deforming_collider, what_sleeps_on_it_wakes_when_it_deforms) {
    Scene bodies = test::lattice_scene({.cells = {3, 3, 3}, .spacing = 0.1, .neighbours = 26});
    constexpr int kStill = 40;
    Shot shot(
        test::terrain(2, 8, -0.2, [](double, double) { return 0.0; }),
        [](const Vec3& p, int f) -> Vec3 {
            return p + Vec3(0, 0, p.z() > -0.1 ? 0.02 * std::max(0, f - kStill) * (1 - 0.5 * p.x() * p.x()) : 0);
        },
        std::move(bodies));
    shot.input.gravity = Vec3(0, 0, -9.81);
    shot.go_on(kStill);
    EXPECT_EQ(std::ranges::count(shot.state.asleep, 1), 27);
    const double before = shot.state.position[0].z();
    shot.go_on(4);
    EXPECT_EQ(std::ranges::count(shot.state.asleep, 1), 0);
    EXPECT_GT(shot.state.position[0].z(), before + 0.05);
}

TEST(deforming_collider, a_frame_that_does_not_tell_of_its_surface_is_refused) {
    Shot shot(
        test::block({-1, -1, -1}, {1, 1, 0}), [](const Vec3& p, int) { return p; }, crumbs());
    shot.input.colliders[0] = {};
    const auto untold = shot.solver->advance(shot.input, shot.settings, shot.state);
    ASSERT_FALSE(untold);
    EXPECT_NE(untold.error().text().find("collider 'mesh'"), std::string::npos) << untold.error().text();
    std::vector<Vec3> end = shot.at(0);
    end[3].x() = std::nan("");
    shot.input.colliders[0] =
        drive_of(std::make_shared<const MovingSurface>(move_surface(shot.scene.colliders[0].tree, shot.at(0), end)));
    const auto bad = shot.solver->advance(shot.input, shot.settings, shot.state);
    ASSERT_FALSE(bad);
    EXPECT_NE(bad.error().text().find("finite"), std::string::npos) << bad.error().text();
}

}  // namespace
}  // namespace sunder
