// Blasts give velocities, and exactly those that they are to give.
#include "solver/frame/blast.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

constexpr double kRadius = 0.5, kSpeed = 12, kExponent = 1.7;

Force force_of(const Blast& blast) {
    Force force;
    force.local = std::make_shared<const LocalForce>(LocalForce{"bomb", 1, blast});
    return force;
}

Blast some_blast() {
    Blast blast;
    blast.center = Vec3(0.3, -0.2, 0.7);
    blast.falloff = {kRadius, kExponent, kNever};
    blast.speed = kSpeed;
    return blast;
}

// Lone cubes around the centre, each a body.
Scene cubes_at(const Vec3& center, const std::vector<Vec3>& arms, double size = 0.01) {
    Scene scene;
    for (const Vec3& arm : arms)
        test::add_body(scene, test::lattice_mesh({.cells = {1, 1, 1}, .spacing = size}),
                       {center + arm - Vec3(0, 0, size / 2), Quat::Identity()});
    return scene;
}

std::vector<Vec3> arms_to_ten_radii() {
    std::vector<Vec3> arms;
    for (int k = 2; k <= 10; ++k)
        arms.push_back(k * kRadius * Vec3(std::cos(2.4 * k), std::sin(2.4 * k), 0.3 * k - 1.5).normalized());
    return arms;
}

struct Exploded {
    std::unique_ptr<Solver> solver;
    FrameState before, after;
};

Exploded explode(const Scene& scene, const Blast& blast, SolverSettings settings = {}, Material material = {}) {
    Exploded it{test::make_solver(scene), {}, {}};
    FrameInput input = test::quiet_input(scene, material);
    input.forces.push_back(force_of(blast));
    it.before = it.after = it.solver->initial_state(input.materials);
    test::advance(*it.solver, input, settings, it.after);
    return it;
}

TEST(blast, free_things_get_the_speed_of_their_distance) {
    const Blast blast = some_blast();
    const std::vector<Vec3> arms = arms_to_ten_radii();
    for (const double budget : {0.0, 0.05}) {
        SolverSettings settings;
        settings.error_budget = budget;
        const Exploded it = explode(cubes_at(blast.center, arms), blast, settings);
        for (size_t i = 0; i < arms.size(); ++i) {
            const double wanted = kSpeed * std::pow(kRadius / arms[i].norm(), kExponent);
            EXPECT_LT((it.after.velocity[i] - wanted * arms[i].normalized()).norm(), 1e-11 * wanted) << i;
        }
    }
}

TEST(blast, it_is_strongest_at_its_radius_and_ends_at_its_reach) {
    Blast blast = some_blast();
    blast.falloff.reach = 2;
    std::vector<Vec3> arms;
    for (const double r : {0.1, 0.25, 0.5, 0.9, 1.9, 2.1, 9.0}) arms.push_back(Vec3(r, 0, 0));
    const Exploded it = explode(cubes_at(blast.center, arms), blast);
    EXPECT_NEAR(it.after.velocity[0].x(), 0.2 * kSpeed, 1e-11);
    EXPECT_NEAR(it.after.velocity[1].x(), 0.5 * kSpeed, 1e-11);
    EXPECT_NEAR(it.after.velocity[2].x(), kSpeed, 1e-10);
    EXPECT_LT(it.after.velocity[3].x(), kSpeed);
    EXPECT_GT(it.after.velocity[4].x(), 0);
    EXPECT_EQ(it.after.velocity[5], Vec3(0, 0, 0));
    EXPECT_EQ(it.after.velocity[6], Vec3(0, 0, 0));
}

// The charge of a vertex, a fragment's very middle, or a hair beside it.
TEST(blast, in_the_middle_of_a_fragment_it_is_finite) {
    Scene scene = test::lattice_scene({.cells = {3, 3, 3}, .spacing = 0.1});
    for (const double beside : {0.0, 1e-300, 1e-15, 1e-9}) {
        Blast blast = some_blast();
        blast.shadow = Shadow::all;
        blast.center = scene.rest.rest_position[13] + Vec3(beside, 0, 0);
        const Exploded it = explode(scene, blast);
        for (const Vec3& v : it.after.velocity) EXPECT_TRUE(v.allFinite() && v.norm() < 10 * kSpeed) << beside;
    }
}

// What a bound body is given is divided by its edges, and neither lost nor made more.
TEST(blast, a_body_keeps_the_momentum_that_its_fragments_were_given) {
    Material tough;
    tough.youngs_modulus = 1e7;
    for (const bool alone : {true, false}) {
        const Scene scene = test::lattice_scene({.cells = {4, 3, 5}, .spacing = 0.1});
        Blast blast = some_blast();
        if (!alone) blast.energy = 300;
        const Exploded it = explode(scene, blast, {}, tough);
        Vec3 wanted = Vec3::Zero(), gained = wanted;
        double most = 0, energy = 0;
        FrameInput input = test::quiet_input(scene, tough);
        const WorkerPool workers(1);
        const SolverSettings settings;
        FrameState given = it.before;
        input.forces.push_back(force_of(blast));
        ASSERT_TRUE(give_blasts({scene, input, settings, workers, 0.01}, given));
        for (size_t i = 0; i < given.n_particles(); ++i) {
            const double m = scene.rest.mass[i];
            const Vec3 share = given.velocity[i] - it.before.velocity[i];
            wanted += m * share, gained += m * it.after.velocity[i];
            most += m * share.norm();
            energy += 0.5 * m * share.squaredNorm();
        }
        EXPECT_GT(wanted.norm(), 0.1 * most);
        EXPECT_LT((gained - wanted).norm(), 1e-9 * most);
        if (!alone) {
            EXPECT_NEAR(energy, 300, 1e-9 * 300);
        }
    }
}

TEST(blast, what_pins_hold_stays) {
    Scene scene = cubes_at(some_blast().center, arms_to_ten_radii());
    test::add_pin(scene, [](const Vec3& x) { return x.z() > 1; });
    Blast blast = some_blast();
    blast.speed = 0, blast.energy = 5;
    const Exploded it = explode(scene, blast);
    double energy = 0;
    size_t held = 0;
    for (size_t i = 0; i < it.after.n_particles(); ++i) {
        energy += 0.5 * scene.rest.mass[i] * it.after.velocity[i].squaredNorm();
        if (scene.rest.rest_position[i].z() <= 1) continue;
        EXPECT_EQ(it.after.velocity[i].norm(), 0);
        ++held;
    }
    EXPECT_GT(held, 0u);
    EXPECT_NEAR(energy, 5, 1e-9) << "all of it goes to what is free";
}

TEST(blast, a_cone_leaves_out_what_lies_beside_it) {
    Blast blast = some_blast();
    blast.direction = Vec3::UnitX(), blast.least_cosine = std::cos(0.5);
    const std::vector<Vec3> arms = {
        {1, 0, 0}, {std::cos(0.49), std::sin(0.49), 0}, {std::cos(0.51), 0, std::sin(0.51)}, {-1, 0, 0}};
    const Exploded it = explode(cubes_at(blast.center, arms), blast);
    for (size_t i = 0; i < arms.size(); ++i) EXPECT_EQ(it.after.velocity[i].norm() > 0, i < 2) << i;
}

// A wall, a crate and a body each throw a shadow where they are asked to.
TEST(blast, nothing_behind_a_wall_is_thrown) {
    const Vec3 center = some_blast().center;
    const std::vector<Vec3> arms = {{2, 0, 0}, {2, 0.3, 0.2}, {-2, 0, 0}, {0, 0, 2}, {0, 2, 0}, {0, 2.2, 0.1}};
    Scene scene = cubes_at(center, arms);
    scene.colliders.resize(2);
    for (Collider& c : scene.colliders) c.shape.kind = ShapeKind::box;
    scene.colliders[0].shape.half_extents = Vec3(0.05, 1, 1);
    scene.colliders[1].shape.kind = ShapeKind::plane;
    RigidBody crate;
    crate.shape.radius = 0.2, crate.mass = 50, crate.pose.position = center + Vec3(-1, 0, 0);
    scene.rigid_bodies.push_back(crate);
    test::add_body(scene, test::lattice_mesh({.cells = {6, 2, 6}, .spacing = 0.1}),
                   {center + Vec3(0, 1, -0.3), Quat::Identity()});
    for (const Shadow shadow : {Shadow::none, Shadow::solids, Shadow::all}) {
        Blast blast = some_blast();
        blast.shadow = shadow;
        FrameInput input = test::quiet_input(scene, Material());
        input.colliders[0].begin.position = input.colliders[0].end.position = center + Vec3(1, 0, 0);
        input.colliders[1].begin.position.z() = input.colliders[1].end.position.z() = center.z() - 0.02;
        const WorkerPool workers(1);
        const SolverSettings settings;
        const auto solver = test::make_solver(scene);
        const std::vector<Vec3> shares =
            shares_of({scene, input, settings, workers, 0.01}, blast, solver->initial_state(input.materials));
        const auto is_thrown = [&](size_t i) { return shares[i].norm() > 0; };
        const bool solids = shadow != Shadow::none, all = shadow == Shadow::all;
        EXPECT_EQ(is_thrown(0), !solids);
        EXPECT_EQ(is_thrown(1), !solids);
        EXPECT_EQ(is_thrown(2), !solids);
        EXPECT_TRUE(is_thrown(3));
        EXPECT_EQ(is_thrown(4), !all);
        EXPECT_EQ(is_thrown(5), !all);
        EXPECT_TRUE(is_thrown(shares.size() - 1)) << "the crate itself";
        size_t thrown = 0;
        for (size_t i = arms.size(); i + 1 < shares.size(); ++i) thrown += is_thrown(i);
        EXPECT_EQ(thrown, all ? 18u : solids ? 36u : 72u) << "of the body: above the floor, and its near side";
    }
}

// Nor has it a share of the energy, which all goes into what is free.
TEST(blast, what_is_held_or_asleep_until_touched_stands) {
    Scene scene = cubes_at(Vec3(0, 0, 0.1), {Vec3(2, 0, 0), Vec3(0, 3, 0), Vec3(-2, 1, 0), Vec3(0, -2, 1)});
    const std::pair<Keeps, Until> kept[] = {
        {Keeps::held, Until::contact}, {Keeps::asleep, Until::frame}, {Keeps::glued, Until::frame}};
    for (uint32_t i = 0; i < std::size(kept); ++i) {
        Activation a;
        a.name = "wait", a.keeps = kept[i].first, a.until = kept[i].second, a.particles = {ParticleId(i)};
        scene.activations.push_back(a);
    }
    Blast blast = some_blast();
    blast.center = Vec3(0, 0, 0.1);
    blast.energy = 5;
    const Exploded it = explode(scene, blast);
    double energy = 0;
    for (size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(it.after.velocity[i] == Vec3(Vec3::Zero()), i < 2) << i;
        EXPECT_EQ(it.after.position[i] == it.before.position[i], i < 2) << i;
        energy += 0.5 * scene.rest.mass[i] * it.after.velocity[i].squaredNorm();
    }
    EXPECT_NEAR(energy, 5, 1e-9);
    EXPECT_EQ(it.after.asleep[1], 1) << "a blast touches nothing";
}

// Fields that act all along a frame, likewise; and what lets go takes up none of what they would have given it.
TEST(blast, fields_move_nothing_that_is_held) {
    Scene scene = cubes_at(Vec3(0, 0, 0.1), {Vec3(2, 0, 0), Vec3(0, 3, 0), Vec3(-2, 1, 0)});
    for (const Keeps keeps : {Keeps::held, Keeps::asleep}) {
        Activation a;
        a.name = "wait", a.keeps = keeps, a.particles = {ParticleId(scene.activations.size())};
        scene.activations.push_back(a);
    }
    FrameInput input = test::quiet_input(scene, Material());
    Force wind, pull;
    wind.wind = Vec3(9, 0, 0), wind.drag = 2;
    pull.local = std::make_shared<const LocalForce>(
        LocalForce{"pull", 1, PointField{.center = Vec3::Zero(), .falloff = {1, 1, kNever}, .strength = 30}});
    input.forces = {wind, pull};
    const auto solver = test::make_solver(scene);
    const FrameState before = solver->initial_state(input.materials);
    FrameState state = before;
    const SolverSettings settings;
    for (int frame = 0; frame < 5; ++frame) test::advance(*solver, input, settings, state);
    for (size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(state.position[i] == before.position[i], i < 2) << i;
        EXPECT_EQ(state.velocity[i] == Vec3(Vec3::Zero()), i < 2) << i;
    }
    for (FrameInput::ActivationDrive& a : input.activations) a.comes = true;
    FrameState free = before;
    free.inactive.assign(3, Inactivity());
    free.asleep.assign(3, 0), free.time = state.time;
    test::advance(*solver, input, settings, free);
    test::advance(*solver, input, settings, state);
    for (size_t i = 0; i < 2; ++i) {
        EXPECT_GT(state.velocity[i].norm(), 0.1);
        EXPECT_LT((state.velocity[i] - free.velocity[i]).norm(), 1e-12) << i;
    }
}

TEST(blast, it_wakes_what_sleeps) {
    Scene scene = cubes_at(Vec3(0, 0, 0.1), {Vec3(2, 0, -0.095), Vec3(0, 3, -0.095)});
    scene.colliders.resize(1);
    scene.colliders[0].shape.kind = ShapeKind::plane;
    const auto solver = test::make_solver(scene);
    FrameInput input = test::quiet_input(scene, Material());
    input.gravity = Vec3(0, 0, -9.81);
    FrameState state = solver->initial_state(input.materials);
    for (int f = 0; f < 36; ++f) test::advance(*solver, input, {}, state);
    ASSERT_EQ(state.asleep, (std::vector<uint8_t>{1, 1}));
    Blast blast = some_blast();
    blast.center = Vec3(0, 0, 0.005);
    input.forces.push_back(force_of(blast));
    test::advance(*solver, input, {}, state);
    EXPECT_EQ(state.asleep, (std::vector<uint8_t>{0, 0}));
    EXPECT_GT(state.velocity[0].x(), 0.1);
}

TEST(blast, one_that_would_throw_something_out_of_this_world_is_refused_by_name) {
    const Scene scene = cubes_at(some_blast().center, {Vec3(1, 0, 0)});
    Blast blast = some_blast();
    blast.energy = 1e12;
    const auto solver = test::make_solver(scene);
    FrameInput input = test::quiet_input(scene, Material());
    input.forces.push_back(force_of(blast));
    FrameState state = solver->initial_state(input.materials);
    const auto report = solver->advance(input, {}, state);
    ASSERT_FALSE(report);
    EXPECT_NE(report.error().text().find("blast 'bomb'"), std::string::npos);
}

}  // namespace
}  // namespace sunder
