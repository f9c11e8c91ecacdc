// Equilibrium before the first frame.
#include "solver/frame/settling.h"

#include <gtest/gtest.h>

#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

constexpr double kG = 9.81;

FrameInput heavy(const Scene& scene, const Material& material) {
    FrameInput in = test::quiet_input(scene, material);
    in.gravity = Vec3(0, 0, -kG);
    return in;
}

// What settled, after so many frames.
struct Shot {
    std::unique_ptr<Solver> solver;
    FrameInput input;
    SolverSettings settings;
    Settled settled;
    FrameState start, state;

    Shot(const Scene& scene, const Material& material, int threads = 1)
        : solver(test::make_solver(scene, threads)), input(heavy(scene, material)) {
        settings.substeps = 16;
        start = solver->initial_state(std::vector(scene.bodies.size(), material));
        const Result<Settled> result = solver->settle(input, settings, start);
        EXPECT_TRUE(result) << (result ? "" : result.error().text());
        if (result) settled = *result;
        state = start;
    }
    void go_on(int frames) {
        for (int k = 0; k < frames; ++k) ASSERT_TRUE(solver->advance(input, settings, state));
    }
};

double farthest(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double most = 0;
    for (size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).norm());
    return most;
}

Material concrete() {
    Material m;
    m.youngs_modulus = 1e7, m.poisson_ratio = 0.2;
    return m;
}

// A plank that is held at one end.
Scene plank() {
    Scene scene = test::lattice_scene({.cells = {12, 2, 2}, .spacing = 0.1, .neighbours = 26, .density = 2000});
    test::add_pin(scene, [](const Vec3& x) { return x.x() < -0.5; });
    scene.bodies[0].settles = true;
    return scene;
}

TEST(Settling, what_hangs_is_where_it_comes_to_rest_and_stays_there) {
    const Scene scene = plank();
    Shot shot(scene, concrete());
    EXPECT_TRUE(shot.settled.at_rest);
    EXPECT_TRUE(shot.settled.breaking.empty());
    const double sag = farthest(scene.rest.rest_position, shot.start.position);
    EXPECT_GT(sag, 0.005);
    shot.go_on(24);
    // At rest is who is accelerated by less than 0.04 of a fall.
    EXPECT_LT(farthest(shot.start.position, shot.state.position), 0.04 * sag);
    // Dropped on its weight, it swings about the same place.
    FrameState swings = shot.solver->initial_state({concrete()});
    double most = 0;
    for (int k = 0; k < 24; ++k) {
        ASSERT_TRUE(shot.solver->advance(shot.input, shot.settings, swings));
        most = std::max(most, farthest(scene.rest.rest_position, swings.position));
    }
    EXPECT_GT(most, 1.4 * sag);
    SolverSettings damped = shot.settings;
    damped.damping = 5;
    for (int k = 0; k < 96; ++k) ASSERT_TRUE(shot.solver->advance(shot.input, damped, swings));
    EXPECT_LT(farthest(shot.start.position, swings.position), 0.04 * sag);
}

// A column bears 1.3 times its weight at rest, and breaks where it arrives all at once, which doubles the strain.
TEST(Settling, what_stands_breaks_nothing_where_its_weight_does_not_arrive_at_once) {
    for (const double fracture_energy : {kNever, 0.0}) {
        Scene scene = plank();
        Material m = concrete();
        m.fracture_energy = fracture_energy;
        m.toughness = 1;  // as good as never: strains are read
        const double strain = std::ranges::max(Shot(scene, m).start.strain);
        m.toughness = 1.4 * strain;
        Shot shot(scene, m);
        shot.go_on(12);
        EXPECT_EQ(test::count_broken(shot.state), 0u) << fracture_energy;
        FrameState dropped = shot.solver->initial_state({m});
        for (int k = 0; k < 12; ++k) ASSERT_TRUE(shot.solver->advance(shot.input, shot.settings, dropped));
        EXPECT_GT(test::count_broken(dropped), 0u) << fracture_energy;
    }
}

TEST(Settling, tells_what_would_break_and_breaks_nothing) {
    Scene scene = plank();
    Material m = concrete();
    m.toughness = 1;
    m.toughness = 0.6 * std::ranges::max(Shot(scene, m).start.strain);
    const Shot shot(scene, m);
    EXPECT_FALSE(shot.settled.breaking.empty());
    EXPECT_EQ(test::count_broken(shot.start), 0u);
    for (const double d : shot.start.edge_damage) EXPECT_EQ(d, 0);
}

// A block stands on the floor, a box on the block, a ball flies by, and another block falls.
Scene heap() {
    Scene scene = test::lattice_scene({.cells = {4, 4, 4}, .spacing = 0.1, .neighbours = 26, .density = 2000});
    scene.bodies[0].settles = true;
    test::add_body(scene, test::lattice_mesh({.cells = {2, 2, 2}, .spacing = 0.1}), {Vec3(2, 0, 1), Quat::Identity()},
                   Vec3(0, 1, -3));
    scene.colliders.push_back({"floor", {ShapeKind::plane}});
    RigidBody box;
    box.name = "box", box.shape.kind = ShapeKind::box, box.shape.half_extents = Vec3(0.15, 0.15, 0.05);
    box.mass = 100, box.pose.position = Vec3(0, 0, 0.45), box.settles = true;
    RigidBody ball;
    ball.name = "ball", ball.shape.radius = 0.1, ball.mass = 5, ball.pose.position = Vec3(-1, 0, 0.2);
    ball.velocity = Vec3(8, 0, 0);
    scene.rigid_bodies = {box, ball};
    return scene;
}

TEST(Settling, what_does_not_settle_waits_with_its_velocity) {
    const Scene scene = heap();
    Shot shot(scene, concrete());
    EXPECT_TRUE(shot.settled.at_rest);
    const FrameState initial = shot.solver->initial_state({concrete(), concrete()});
    const auto begin = scene.bodies[1].particle_begin;
    for (uint32_t i = begin; i < scene.bodies[1].particle_end; ++i) {
        EXPECT_EQ(shot.start.position[i], initial.position[i]);
        EXPECT_EQ(shot.start.velocity[i], initial.velocity[i]);
    }
    EXPECT_EQ(shot.start.rigid_bodies[1], initial.rigid_bodies[1]);
    EXPECT_EQ(shot.start.time, 0);
    // The box bears on the block, which its own weight and the box have pressed.
    EXPECT_LT(shot.start.rigid_bodies[0].position.z(), 0.45 - 1e-4);
    const std::vector<Vec3> block(shot.start.position.begin(), shot.start.position.begin() + begin);
    const Vec3 box = shot.start.rigid_bodies[0].position;
    shot.settings.sleeping = false;
    shot.go_on(2);  // the ball has not come yet
    const std::vector<Vec3> now(shot.state.position.begin(), shot.state.position.begin() + begin);
    const double pressed = 0.45 - box.z();
    EXPECT_LT(farthest(block, now), 0.06 * pressed);
    EXPECT_LT((shot.state.rigid_bodies[0].position - box).norm(), 0.06 * pressed);
}

TEST(Settling, has_the_same_bits_for_any_number_of_threads) {
    const Scene scene = heap();
    const FrameState one = Shot(scene, concrete()).start, two = Shot(scene, concrete(), 2).start;
    EXPECT_EQ(state_hash(one), state_hash(two));
}

TEST(Settling, what_bears_nothing_stays_as_it_is) {
    const Scene scene = plank();
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({concrete()});
    const FrameState initial = state;
    const Result<Settled> settled = solver->settle(test::quiet_input(scene, concrete()), {}, state);
    ASSERT_TRUE(settled) << settled.error().text();
    EXPECT_TRUE(settled->at_rest);
    EXPECT_LT(farthest(initial.position, state.position), 1e-12);
}

TEST(Settling, tells_what_never_comes_to_rest) {
    Scene scene = test::lattice_scene({.cells = {2, 2, 2}, .spacing = 0.1});
    scene.bodies[0].settles = true;  // and nothing is below
    EXPECT_FALSE(Shot(scene, concrete()).settled.at_rest);
}

TEST(Settling, can_be_cancelled_and_leaves_the_state) {
    const Scene scene = plank();
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({concrete()});
    const uint64_t before = state_hash(state);
    int asked = 0;
    const Progress::Callback cancel = [&](double, std::string_view) { return ++asked < 5; };
    const Result<Settled> settled = solver->settle(heavy(scene, concrete()), {}, state, Progress(cancel));
    ASSERT_FALSE(settled);
    EXPECT_EQ(settled.error().code, ErrorCode::cancelled);
    EXPECT_EQ(state_hash(state), before);
}

}  // namespace
}  // namespace sunder
