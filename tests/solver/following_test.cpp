// What follows a source is where that has it, to rounding, and goes on from there with its speed and spin.
#include "solver/step/following.h"

#include <gtest/gtest.h>

#include "solver/data/math_functions.h"
#include "solver/data/rotations.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

constexpr double kFrame = 1.0 / 24;  // s

using MotionOf = std::function<SourcePose(int frame)>;

// Round a circle about an axis beside the body, 20 degrees a frame.
SourcePose round_turn(int frame) {
    SourcePose pose;
    pose.whole.orientation = rotation_about(Vec3::UnitZ(), frame * 0.35);
    pose.whole.position = Vec3(1, 0, 0) - pose.whole.orientation * Vec3(1, 0, 0);
    return pose;
}

Material brittle() {
    Material m;
    m.youngs_modulus = 1e7, m.toughness = 1e-3;
    return m;
}

struct Shot {
    MotionOf motion;
    std::unique_ptr<Solver> solver;
    FrameInput input;
    SolverSettings settings;
    FrameState state;
    int frame = 0, last = 1000;  // of the motion

    Shot(Scene scene, MotionOf of, Until until = Until::frame, const Material& material = brittle(), int threads = 1)
        : motion(std::move(of)) {
        Activation a;
        a.name = "rig", a.until = until;
        Source source;
        source.name = "rig", source.start = std::make_shared<const SourcePose>(motion(0));
        for (ParticleId i(0); i < scene.bodies[0].particle_end; ++i)
            a.particles.push_back(i), source.particles.push_back(i);
        scene.activations = {a}, scene.sources = {source};
        solver = test::make_solver(scene, threads), input = test::quiet_input(scene, material);
        state = solver->initial_state(input.materials);
    }
    void go_on(int frames, bool lets_go = false) {
        input.activations[0].comes |= lets_go;
        for (int k = 0; k < frames; ++k, ++frame) {
            const auto at = [&](int f) { return std::make_shared<const SourcePose>(motion(std::min(f, last))); };
            input.sources = {{at(frame), at(frame + 1), Vec3(1, 0, 0), frame < last}};
            test::advance(*solver, input, settings, state);
        }
    }
    const SimulationMesh& rest() const { return solver->scene().rest; }
    // How far what follows is from where the source has it, m and -.
    double error() const {
        const SourcePose pose = motion(std::min(frame, last));
        const SourceWay way(pose, pose, Vec3::Zero(), 0);
        double most = 0;
        for (const ParticleId i : solver->scene().sources[0].particles) {
            const Pose at = way.pose(rest().fragment[i], rest().rest_position[i]);
            most = std::max(most, (at.apply(rest().rest_position[i]) - state.position[i]).norm());
            most = std::max(most, angle_between(at.orientation * rest().rest_orientation[i], state.orientation[i]));
        }
        return most;
    }
    Vec3 momentum() const {
        Vec3 sum = Vec3::Zero();
        for (size_t i = 0; i < state.n_particles(); ++i) sum += rest().mass[i] * state.velocity[i];
        return sum;
    }
};

Scene block() { return test::lattice_scene({.cells = {3, 3, 3}, .spacing = 0.1, .neighbours = 26}); }

TEST(following, it_is_carried_round_without_a_strain) {
    Shot shot(block(), round_turn);
    for (int k = 0; k < 12; ++k) {
        shot.go_on(1);
        EXPECT_LT(shot.error(), 1e-12);
    }
    EXPECT_EQ(test::count_broken(shot.state), 0u);
    // In steps of h it is as fast as the chord of one.
    const double h = kFrame / shot.settings.substeps, angle = 0.35 / shot.settings.substeps;
    const double speed = (shot.state.position[0] - Vec3(1, 0, 0)).head<2>().norm() * 2 * std::sin(angle / 2) / h;
    EXPECT_NEAR(shot.state.velocity[0].norm(), speed, 1e-9);
}

TEST(following, it_is_let_go_with_its_speed_and_spin) {
    Shot shot(block(), round_turn);
    shot.go_on(10);
    Vec3 center = Vec3::Zero();
    for (const Vec3& x : shot.state.position) center += x / 27.0;
    shot.go_on(1, true);
    const Vec3 arm = center - Vec3(1, 0, 0), wanted = Vec3(0, 0, 0.35 / kFrame).cross(Vec3(arm.x(), arm.y(), 0));
    const Vec3 velocity = shot.momentum() / 27.0;  // kg
    EXPECT_LT((velocity - wanted).norm(), 0.01 * wanted.norm());
    for (const Vec3& spin : shot.state.angular_velocity) EXPECT_NEAR(spin.z(), 0.35 / kFrame, 0.01 * 0.35 / kFrame);
    for (const Inactivity& i : shot.state.inactive) EXPECT_NEAR(i.followed, 10 * kFrame, 1e-12);
    const Vec3 before = shot.momentum();
    shot.go_on(10);
    EXPECT_LT((shot.momentum() - before).norm(), 1e-12 * before.norm());
}

TEST(following, a_source_that_ends_lets_go_as_fast_as_it_was) {
    const auto straight = [](int frame) {
        SourcePose pose;
        pose.whole.position = Vec3(0.1 * frame, 0, 0);
        return pose;
    };
    Shot shot(block(), straight);
    shot.last = 5;
    shot.go_on(5);
    shot.go_on(1, true);
    for (const Vec3& v : shot.state.velocity) EXPECT_NEAR((v - Vec3(2.4, 0, 0)).norm(), 0, 1e-9);
}

// Stretched evenly to one and a half times its height, and thinner.
SourcePose stretched(const SimulationMesh& rest, int frame, bool is_set) {
    const double s = 1 + 0.05 * std::min(frame, 10);
    SourcePose pose;
    for (const Vec3& x : rest.rest_position) {
        const Vec3 at(x.x() / std::sqrt(s), x.y() / std::sqrt(s), x.z() * s);
        pose.own.push_back({at - x, Quat::Identity()});
        if (is_set) pose.set.push_back(Vec3(1 / std::sqrt(s), 1 / std::sqrt(s), s).asDiagonal());
    }
    return pose;
}

TEST(following, its_stretch_is_its_rest_or_a_strain) {
    const Scene scene = block();
    Material soft;
    soft.youngs_modulus = 1e5;
    for (const bool is_set : {true, false}) {
        Shot shot(
            scene, [&](int frame) { return stretched(scene.rest, frame, is_set); }, Until::frame, soft);
        shot.go_on(12);  // it stands from the tenth on
        EXPECT_LT(shot.error(), 1e-12);
        EXPECT_EQ(test::count_broken(shot.state), 0u);
        EXPECT_EQ(shot.state.plastic_deformation[13].isIdentity(1e-3), !is_set);
        const FrameState held = shot.state;
        shot.go_on(4, true);
        double most = 0;
        for (size_t i = 0; i < 27; ++i) most = std::max(most, (shot.state.position[i] - held.position[i]).norm());
        EXPECT_EQ(most > 0.02, !is_set) << most;
    }
}

// Edges that nothing bears are none to break, however far a source stretches them.
TEST(following, it_does_not_break_of_its_motion_and_then_does) {
    const Scene scene = block();
    Shot shot(scene, [&](int frame) { return stretched(scene.rest, frame, false); });
    shot.go_on(10);
    EXPECT_EQ(test::count_broken(shot.state), 0u);
    shot.go_on(1, true);
    EXPECT_GT(test::count_broken(shot.state), 20u);
}

Scene beside_a_ball() {
    Scene scene = block();
    RigidBody ball;
    ball.name = "ball", ball.shape.radius = 0.1, ball.mass = 2, ball.pose.position = Vec3(1, 0, 0.15);
    scene.rigid_bodies = {ball};
    return scene;
}

SourcePose ahead(int frame) {
    SourcePose pose;
    pose.whole.position = Vec3(0.1 * frame, 0, 0);
    return pose;
}

TEST(following, it_pushes_what_is_in_its_way) {
    Shot shot(beside_a_ball(), ahead);
    shot.go_on(12);
    EXPECT_LT(shot.error(), 1e-12);
    EXPECT_GT(shot.state.rigid_bodies[0].velocity.x(), 2.3);
}

TEST(following, a_contact_lets_it_go_and_all_momentum_is_there) {
    Shot shot(beside_a_ball(), ahead, Until::contact, Material());
    shot.go_on(12);
    size_t n_gone = 0;
    for (const Inactivity& i : shot.state.inactive) n_gone += i.what == 0;
    EXPECT_GT(n_gone, 0u);
    EXPECT_LT(n_gone, 27u);
    for (const Inactivity& i : shot.state.inactive) EXPECT_EQ(i.what == 0, i.followed != HUGE_VAL);
}

TEST(following, what_fell_asleep_goes_on_when_its_source_does) {
    const auto waits = [](int frame) {
        SourcePose pose;
        pose.whole.position = Vec3(0, 0, 0.02 * std::max(frame - 40, 0));
        return pose;
    };
    Shot shot(block(), waits);
    shot.go_on(40);
    EXPECT_TRUE(shot.state.asleep[0]);
    shot.go_on(5);
    EXPECT_LT(shot.error(), 1e-12);
    shot.go_on(1, true);
    EXPECT_NEAR(shot.state.velocity[0].z(), 0.02 / kFrame, 1e-9);
}

TEST(following, its_bits_are_those_of_any_number_of_threads_and_any_state_it_goes_on_from) {
    const auto shot_of = [](int threads) { return Shot(beside_a_ball(), ahead, Until::contact, Material(), threads); };
    Shot one = shot_of(1), three = shot_of(3);
    for (int k = 0; k < 14; ++k) {
        one.go_on(1), three.go_on(1);
        ASSERT_EQ(state_hash(one.state), state_hash(three.state)) << k;
        Shot other = shot_of(1);
        other.frame = k + 1, other.state = one.state;
        other.go_on(1);
        const FrameState kept = one.state;
        one.go_on(1);
        ASSERT_EQ(state_hash(other.state), state_hash(one.state)) << k;
        one.state = kept, one.frame = k + 1;
    }
}

TEST(following, what_is_wrong_is_told) {
    Shot shot(block(), round_turn);
    shot.input.sources.clear();
    EXPECT_FALSE(shot.solver->advance(shot.input, shot.settings, shot.state));
    SourcePose bad = round_turn(1);
    bad.own.resize(3);
    const auto start = std::make_shared<const SourcePose>(round_turn(0)), end = std::make_shared<const SourcePose>(bad);
    shot.input.sources = {{start, end}};
    const auto told = shot.solver->advance(shot.input, shot.settings, shot.state);
    ASSERT_FALSE(told);
    EXPECT_NE(told.error().text().find("source 'rig'"), std::string::npos) << told.error().text();
}

}  // namespace
}  // namespace sunder
