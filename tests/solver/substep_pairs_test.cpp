// What pairs of substeps must keep: momentum of all kinds, damping as asked, and the pair when something else wakes.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

using test::advance;

Vec3 angular_momentum(const Vec3& moments, const Quat& orientation, const Vec3& spin) {
    return orientation * moments.cwiseProduct(orientation.conjugate() * spin);
}

TEST(substep_pairs, a_free_box_keeps_its_angular_momentum) {
    const Vec3 half(0.1, 0.2, 0.4), squared = half.cwiseProduct(half);
    const Vec3 moments = (squared.sum() * Vec3::Ones() - squared) / 3;  // of a kilogram
    Scene scene;
    RigidBody box;
    box.name = "box", box.shape.kind = ShapeKind::box, box.shape.half_extents = half;
    box.angular_velocity = Vec3(3, 1, 2);
    scene.rigid_bodies.push_back(box);
    const auto solver = test::make_solver(scene);
    for (const int substeps : {1, 7, 8, 32}) {
        FrameState state = solver->initial_state({});
        SolverSettings settings;
        settings.substeps = substeps;
        for (int f = 0; f < 24; ++f) advance(*solver, test::quiet_input(scene, {}), settings, state);
        const RigidBodyState& s = state.rigid_bodies[0];
        const Vec3 before = moments.cwiseProduct(box.angular_velocity);
        EXPECT_LE((angular_momentum(moments, s.orientation, s.angular_velocity) - before).norm(), 1e-12)
            << substeps << " substeps";
    }
}

// The solver's damping, not the material's: all velocities decay as exp(-damping t).
TEST(substep_pairs, damping_slows_turning_as_it_does_flying) {
    Scene scene;
    test::add_body(scene, test::lattice_mesh({{1, 1, 1}, 0.1, 6, 1000, {}}));
    test::add_body(scene, test::lattice_mesh({{3, 3, 3}, 0.1, 26, 1000, {}}), {Vec3(5, 0, 0), Quat::Identity()});
    RigidBody ball;
    ball.name = "ball", ball.pose.position = Vec3(-5, 0, 0);
    ball.velocity = Vec3(1, 0, 0), ball.angular_velocity = Vec3(0, 2, 0);
    scene.rigid_bodies.push_back(ball);
    for (Body& b : scene.bodies) b.velocity = Vec3(1, 0, 0), b.angular_velocity = Vec3(0, 2, 0);
    const auto solver = test::make_solver(scene);
    for (const int substeps : {1, 8, 32}) {
        FrameState state = solver->initial_state({{}, {}});
        SolverSettings settings;
        settings.substeps = substeps, settings.damping = 2;
        for (int f = 0; f < 24; ++f) advance(*solver, test::quiet_input(scene, {}), settings, state);
        const double left = std::exp(-2.0);
        const auto expect_slowed = [&](const Vec3& v, const Vec3& w, double rounding) {
            EXPECT_NEAR(v.x(), left, rounding) << substeps << " substeps";
            EXPECT_NEAR(w.y(), 2 * left, rounding) << substeps << " substeps";
        };
        expect_slowed(state.velocity[0], state.angular_velocity[0], 1e-10);
        expect_slowed(state.rigid_bodies[0].velocity, state.rigid_bodies[0].angular_velocity, 1e-10);
        expect_slowed(state.velocity[14], state.angular_velocity[14], 0.01);  // the middle of the body, which stretches
    }
}

TEST(substep_pairs, damping_of_the_material_takes_no_momentum) {
    const Scene scene = test::lattice_scene({});
    const auto solver = test::make_solver(scene);
    for (const int substeps : {8, 32}) {
        for (const double damping_time : {2e-3, 0.05}) {
            Material material;
            material.damping_time = damping_time;
            SolverSettings settings;
            settings.substeps = substeps;
            FrameState state = solver->initial_state({material});
            for (size_t i = 0; i < state.n_particles(); ++i)
                state.velocity[i] = Vec3(0.3 * std::sin(double(i)), 0, 0.2 + 0.5 * std::cos(double(i)));
            const auto linear = [&] {
                Vec3 p = Vec3::Zero();
                for (size_t i = 0; i < state.n_particles(); ++i) p += scene.rest.mass[i] * state.velocity[i];
                return p;
            };
            const Vec3 before = linear();
            for (int f = 0; f < 24; ++f) advance(*solver, test::quiet_input(scene, material), settings, state);
            EXPECT_LE((linear() - before).norm(), 1e-9 * before.norm())
                << substeps << " substeps, damping time " << damping_time;
        }
    }
}

// Things fall far off while a ball wakes a block that sleeps: in the first substep of a pair, or the second.
TEST(substep_pairs, what_wakes_elsewhere_takes_nothing_off_its_parabola) {
    constexpr double kHeight = 1000, kGravity = 9.81;
    Scene scene;
    scene.colliders.push_back({"floor", {ShapeKind::plane}, 0.5, 0.0});
    test::add_body(scene, test::lattice_mesh({{3, 3, 3}, 0.1, 6, 1000, {}}));
    test::add_body(scene, test::lattice_mesh({{1, 1, 1}, 0.1, 6, 1000, {}}), {Vec3(0, 0, kHeight), Quat::Identity()});
    RigidBody ball;
    ball.name = "ball", ball.shape.radius = 0.1, ball.mass = 4;
    ball.pose.position = Vec3(5, 0, kHeight);
    scene.rigid_bodies = {ball, ball};
    const uint32_t fragment = scene.bodies[1].particle_begin;
    const double start = scene.rest.rest_position[fragment].z();
    SolverSettings settings;
    settings.substeps = 2;  // long ones: a substep out of its pair falls 2 mm less
    for (const double height : {8.6, 8.75, 8.9, 9.05}) {
        scene.rigid_bodies[1].pose.position = Vec3(0, 0, height);
        const auto solver = test::make_solver(scene);
        FrameInput input = test::quiet_input(scene, {});
        input.gravity = Vec3(0, 0, -kGravity);
        FrameState state = solver->initial_state(input.materials);
        size_t most = 0;
        for (int f = 1; f <= 36; ++f) {
            most = std::max(most, advance(*solver, input, settings, state).asleep);
            const double fallen = 0.5 * kGravity * std::pow(f * input.duration, 2);
            ASSERT_NEAR(state.position[fragment].z(), start - fallen, 1e-9) << "frame " << f << ", from " << height;
            ASSERT_NEAR(state.rigid_bodies[0].position.z(), kHeight - fallen, 1e-9) << "frame " << f;
        }
        EXPECT_EQ(most, 27u);  // the block slept when it was hit
        EXPECT_EQ(std::count(state.asleep.begin(), state.asleep.end(), 1), 0);
    }
}

}  // namespace
}  // namespace sunder
