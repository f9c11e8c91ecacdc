// Forces that differ from place to place: what they are, and that a step gives things just that.
#include "solver/scene/local_fields.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "solver/pieces/momentum.h"
#include "solver/scene/curl_noise.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

Force force_of(LocalForce::Kind kind, double drag = 0) {
    Force force;
    force.local = std::make_shared<const LocalForce>(LocalForce{"field", 1, std::move(kind), drag});
    return force;
}

Pull pull_at(const Force& force, const Vec3& x) {
    FrameInput input;
    input.forces.push_back(force);
    return LocalFields(Scene(), input, FrameState()).on({size_t{0}, x, Quat::Identity(), 0.01});
}

// One loose cube of 1 cm at each place.
Scene cubes_at(const std::vector<Vec3>& places) {
    Scene scene;
    for (const Vec3& place : places)
        test::add_body(scene, test::lattice_mesh({.cells = {1, 1, 1}, .spacing = 0.01}),
                       {place - Vec3(0, 0, 0.005), Quat::Identity()});
    return scene;
}

TEST(local_fields, a_point_pushes_outwards_most_at_its_radius_and_not_beyond_its_reach) {
    const PointField field{Vec3(1, 2, 3), {0.5, 2, 4}, 8};
    const auto along_x = [&](double r) { return pull_at(force_of(field), field.center + Vec3(r, 0, 0)).acceleration; };
    EXPECT_EQ(along_x(0), Vec3(0, 0, 0));
    EXPECT_NEAR(along_x(0.25).x(), 4, 1e-14);
    EXPECT_NEAR(along_x(-0.5).x(), -8, 1e-14);
    EXPECT_NEAR(along_x(2).x(), 0.5, 1e-14);
    EXPECT_EQ(along_x(4.01), Vec3(0, 0, 0));
    EXPECT_TRUE(along_x(1e-310).allFinite());
}

TEST(local_fields, a_vortex_turns_like_a_solid_within_its_radius) {
    VortexField field{Vec3(1, 0, 0), Vec3::UnitZ(), {2, 1, 10}};
    field.swirl = 6, field.inflow = 1, field.lift = 0.5;
    const auto at = [&](const Vec3& x) { return pull_at(force_of(field, 3), x); };
    EXPECT_LT((at(Vec3(2, 0, 7)).acceleration / 3 - Vec3(-0.5, 3, 0.5)).norm(), 1e-14);
    EXPECT_LT((at(Vec3(1, 4, 0)).acceleration / 3 - Vec3(-3, -0.5, 0.25)).norm(), 1e-14);
    EXPECT_EQ(at(Vec3(1, 4, 0)).drag, 3);
    EXPECT_EQ(at(Vec3(1, 10.1, 0)).drag, 0) << "nor does its air hold anything back";
    EXPECT_TRUE(at(field.center).acceleration.allFinite());
}

TEST(curl_noise, has_no_divergence_and_the_strength_that_is_asked_for) {
    for (const int octaves : {1, 3})
        for (const double time : {0.0, 0.3, 7.5}) {
            double square = 0, divergence = 0, slopes = 0;
            size_t n = 0;
            constexpr double kBy = 1e-5;
            for (double x = -7.3; x < 7; x += 0.77)
                for (double y = -7.1; y < 7; y += 0.81)
                    for (double z = -7.2; z < 7; z += 0.79, ++n) {
                        const Vec3 here(x, y, z);
                        square += curl_noise(here, time, octaves, 5).squaredNorm();
                        double own = 0;
                        for (int i = 0; i < 3; ++i) {
                            const Vec3 by = kBy * Vec3::Unit(i);
                            const Vec3 slope =
                                (curl_noise(here + by, time, octaves, 5) - curl_noise(here - by, time, octaves, 5)) /
                                (2 * kBy);
                            own += slope[i], slopes += slope.norm();
                        }
                        divergence += std::abs(own);
                    }
            EXPECT_NEAR(std::sqrt(square / static_cast<double>(n)), 1, 0.05) << octaves << " octaves at " << time;
            EXPECT_LT(divergence, 1e-6 * slopes);
        }
}

TEST(curl_noise, is_smooth_in_time_and_over_the_borders_of_its_cells) {
    const Vec3 x(3, -2.4, 0.7);
    for (const double border : {2.0, 5.0}) {
        EXPECT_LT((curl_noise(x, border - 1e-9, 2, 1) - curl_noise(x, border + 1e-9, 2, 1)).norm(), 1e-7);
        const Vec3 at(border, -1.2, 0.4), by(1e-9, 0, 0);
        EXPECT_LT((curl_noise(at - by, 0, 2, 1) - curl_noise(at + by, 0, 2, 1)).norm(), 1e-6);
    }
    EXPECT_GT((curl_noise(x, 0, 2, 1) - curl_noise(x, 0, 2, 2)).norm(), 1e-3);
    EXPECT_GT((curl_noise(x, 0, 2, 1) - curl_noise(x, 1, 2, 1)).norm(), 1e-3);
    EXPECT_TRUE(curl_noise(Vec3(1e300, -1e300, 0), 1e9, 8, 1).allFinite());
}

// Of additions, multiplications and square roots alone: these bits are those of every machine.
TEST(curl_noise, has_the_bits_that_it_always_had) {
    EXPECT_EQ(curl_noise(Vec3(0.3, 1.7, -2.2), 0.4, 3, 42).sum(), -0x1.b4e242c6fc0ap-1);
    EXPECT_EQ(noise_in_time(2.6, 42), -0x1.30e5be616dd8ap-3);
}

TEST(noise_in_time, stays_within_one_and_goes_through_all_of_it) {
    double least = 1, most = -1, before = noise_in_time(-10, 3);
    for (double t = -10; t < 90; t += 0.01) {
        const double now = noise_in_time(t, 3);
        least = std::min(least, now), most = std::max(most, now);
        EXPECT_LT(std::abs(now - before), 0.05);
        before = now;
    }
    EXPECT_TRUE(least >= -1 && least < -0.8 && most <= 1 && most > 0.8) << least << " " << most;
}

// In one step, of two bodies that hang together and one that does not.
TEST(local_fields, a_body_is_given_the_momentum_and_the_spin_of_its_forces) {
    Scene scene = test::lattice_scene({.cells = {3, 2, 4}, .spacing = 0.1});
    test::add_body(scene, test::lattice_mesh({.cells = {1, 1, 1}, .spacing = 0.1}),
                   {Vec3(0.7, 0.1, 0.2), Quat::Identity()});
    VortexField vortex{Vec3(0.4, 0.2, 0), Vec3(1, 2, 2) / 3, {0.5, 1.5, kNever}};
    vortex.swirl = 5, vortex.lift = 2;
    TurbulenceField eddies;
    eddies.strength = 4, eddies.size = 0.3, eddies.octaves = 2;
    Material material;
    material.youngs_modulus = 1e6;
    for (const double drag : {0.0, 7.0}) {
        FrameInput input = test::quiet_input(scene, material, 1.0 / 240);
        input.forces = {force_of(vortex, drag), force_of(eddies, drag), force_of(PointField{Vec3(0, 0, 0.3), {}, -30})};
        SolverSettings settings;
        settings.substeps = 1;
        const auto solver = test::make_solver(scene);
        FrameState state = solver->initial_state(input.materials);
        const FrameState before = state;
        test::advance(*solver, input, settings, state);
        const LocalFields fields(scene, input, before);
        for (const Body& body : scene.bodies) {
            Vec3 wanted = Vec3::Zero(), gained = wanted, wanted_spin = wanted, gained_spin = wanted, center = wanted,
                 later = wanted;
            double most = 0, mass = 0;
            for (uint32_t i = body.particle_begin; i < body.particle_end; ++i) {
                const double m = scene.rest.mass[i];
                mass += m, center += m * before.position[i], later += m * state.position[i];
            }
            center /= mass, later /= mass;
            for (uint32_t i = body.particle_begin; i < body.particle_end; ++i) {
                const double m = scene.rest.mass[i], h = input.duration;
                const Pull pull = fields.on({i, before.position[i], Quat::Identity(), h});
                const Vec3 given = m * h / (1 + h * pull.drag) * pull.acceleration;
                wanted += given, gained += m * state.velocity[i], most += given.norm();
                wanted_spin += (before.position[i] - center).cross(given);
                const Quat turn = state.orientation[i] * scene.rest.rest_orientation[i].conjugate();
                const Vec3 radii = scene.rest.radii[i].cwiseProduct(scene.rest.radii[i]);
                const Mat3 axes = (turn * scene.rest.rest_orientation[i]).toRotationMatrix();
                const Vec3 moments = m / 5 * (radii.sum() * Vec3::Ones() - radii);
                gained_spin += m * (state.position[i] - later).cross(state.velocity[i]) +
                               axes * moments.cwiseProduct(axes.transpose() * state.angular_velocity[i]);
            }
            EXPECT_GT(wanted.norm(), 0.1 * most);
            EXPECT_LT((gained - wanted).norm(), 1e-9 * most) << body.name;
            EXPECT_LT((gained_spin - wanted_spin).norm(), 1e-9 * most * 0.4) << body.name;
        }
    }
}

// Within its radius a point that draws in is a spring.
TEST(local_fields, what_a_point_draws_swings_through_it) {
    const Scene scene = cubes_at({Vec3(0.3, 0, 0)});
    const double omega = 2 * std::numbers::pi;  // a second there and back
    FrameInput input = test::quiet_input(scene, Material());
    input.forces.push_back(force_of(PointField{Vec3::Zero(), {1, 2, kNever}, -omega * omega}));
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state(input.materials);
    for (int frame = 0; frame < 24; ++frame) {
        test::advance(*solver, input, {}, state);
        if (frame == 11) {
            EXPECT_NEAR(state.position[0].x(), -0.3, 0.003);
        }
    }
    EXPECT_NEAR(state.position[0].x(), 0.3, 0.003);
}

TEST(local_fields, a_whirlwind_takes_things_along_at_its_speed) {
    const Scene scene = cubes_at({Vec3(0.4, 0, 0), Vec3(30, 0, 0)});
    FrameInput input = test::quiet_input(scene, Material());
    VortexField field{Vec3::Zero(), Vec3::UnitZ(), {1, 1, 20}};
    field.lift = 3;
    input.forces.push_back(force_of(field, 10));
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state(input.materials);
    for (int frame = 0; frame < 48; ++frame) test::advance(*solver, input, {}, state);
    EXPECT_NEAR(state.velocity[0].z(), 3, 1e-6);
    EXPECT_EQ(state.velocity[1], Vec3(0, 0, 0));
}

// A critically damped spring, whose step is implicit: the same for any step, and no faster than the closed form.
TEST(local_fields, a_guide_brings_fragments_to_their_pose_and_turn) {
    const Scene scene = cubes_at({Vec3(0.3, 0, 0), Vec3(0, 1, 0)});
    for (const double rate : {2.0, 900.0}) {
        Guide guide;
        guide.rate = rate;
        guide.pose.begin = guide.pose.end = {Vec3(0, 0, 1), Quat(std::cos(0.6), 0, 0, std::sin(0.6))};
        Force force = force_of(guide);
        LocalForce own = *force.local;
        own.body = "body0";
        force.local = std::make_shared<const LocalForce>(own);
        FrameInput input = test::quiet_input(scene, Material());
        input.forces.push_back(force);
        const auto solver = test::make_solver(scene);
        FrameState state = solver->initial_state(input.materials);
        const FrameState before = state;
        const Vec3 target = guide.pose.end.apply(before.position[0]);
        for (int frame = 0; frame < 24; ++frame) test::advance(*solver, input, {}, state);
        const double left = (state.position[0] - target).norm() / (before.position[0] - target).norm();
        EXPECT_NEAR(left, rate > 10 ? 0 : (1 + rate) * std::exp(-rate), rate > 10 ? 1e-9 : 0.02);
        for (int frame = 0; frame < 240; ++frame) test::advance(*solver, input, {}, state);
        EXPECT_LT((state.position[0] - target).norm(), 1e-6);
        const Quat turn = state.orientation[0] * before.orientation[0].conjugate();
        EXPECT_GT(std::abs(turn.dot(guide.pose.end.orientation)), 1 - 1e-9);
        EXPECT_EQ(state.position[1], before.position[1]) << "it is not its body";
    }
}

TEST(local_fields, a_guide_keeps_up_with_what_moves) {
    const Scene scene = cubes_at({Vec3(0.3, 0, 0)});
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({Material()});
    for (int frame = 0; frame < 48; ++frame) {
        Guide guide;
        guide.rate = 20;
        guide.pose.begin.position.x() = frame / 24.0, guide.pose.end.position.x() = (frame + 1) / 24.0;
        FrameInput input = test::quiet_input(scene, Material());
        input.forces.push_back(force_of(guide));
        test::advance(*solver, input, {}, state);
    }
    EXPECT_NEAR(state.position[0].x(), 2.3, 1e-6);
    EXPECT_NEAR(state.velocity[0].x(), 1, 1e-6);
}

// A field that starts to push wakes what sleeps, and one that stays lets it sleep.
TEST(local_fields, what_lies_still_in_a_lasting_field_sleeps) {
    Scene scene = cubes_at({Vec3(2, 0, 0.005)});
    scene.colliders.resize(1);
    scene.colliders[0].shape.kind = ShapeKind::plane, scene.colliders[0].friction = 0.5;
    const auto solver = test::make_solver(scene);
    FrameInput input = test::quiet_input(scene, Material());
    input.gravity = Vec3(0, 0, -9.81);
    input.forces.push_back(
        force_of(PointField{Vec3::Zero(), {1, 2, kNever}, -2}));  // 0.5 m/s2 there: friction holds it
    FrameState state = solver->initial_state(input.materials);
    for (int f = 0; f < 36; ++f) test::advance(*solver, input, {}, state);
    EXPECT_EQ(state.asleep[0], 1);
    LocalForce stronger = *input.forces[0].local;
    std::get<PointField>(stronger.kind).strength = -60, stronger.key = 2;
    input.forces[0].local = std::make_shared<const LocalForce>(stronger);
    for (int f = 0; f < 4; ++f) test::advance(*solver, input, {}, state);
    EXPECT_EQ(state.asleep[0], 0);
    EXPECT_LT(state.position[0].x(), 1.98);
}

}  // namespace
}  // namespace sunder
