// Each scale has one definition: what acts alike moves alike, however it is said.
#include "solver/scene/scales.h"

#include <gtest/gtest.h>

#include "tests/support/hit_scene.h"

namespace sunder {
namespace {

enum class Said { as_gravity, as_a_force, as_both };

// 9.81 m/s2 downwards.
FrameInput falling(FrameInput in, Said how) {
    const Vec3 down(0, 0, -9.81);
    in.gravity = how == Said::as_gravity ? down : Vec3(Vec3::Zero());
    if (how == Said::as_a_force) in.forces.push_back({down, Vec3::Zero(), 0});
    if (how == Said::as_both) in.gravity = 2 * down, in.forces.push_back({-down, Vec3::Zero(), 0});
    return in;
}

struct Shot {
    Scene scene;
    Material material;
    SolverSettings settings;

    void add_floor() {
        Collider floor;
        floor.name = "floor", floor.shape.kind = ShapeKind::plane;
        scene.colliders.push_back(floor);
    }
    std::vector<FrameState> run(int frames, Said how) const {
        const auto solver = test::make_solver(scene);
        FrameState state = solver->initial_state(std::vector(scene.bodies.size(), material));
        std::vector<FrameState> states;
        for (int f = 0; f < frames; ++f) {
            test::advance(*solver, falling(test::quiet_input(scene, material), how), settings, state);
            states.push_back(state);
        }
        return states;
    }
};

// A plank that pins hold, with 100 kg on its end.
Shot loaded_plank() {
    Shot shot;
    test::add_body(shot.scene, test::lattice_mesh({{12, 4, 2}, 0.1, 6, 1000, {}}), {Vec3(0, 0, 1), Quat::Identity()});
    test::add_pin(shot.scene, [](const Vec3& x) { return x.x() < -0.45; });
    RigidBody weight;
    weight.name = "weight", weight.shape.kind = ShapeKind::box, weight.mass = 100, weight.friction = 1;
    weight.shape.half_extents = Vec3(0.1, 0.2, 0.1), weight.pose.position = Vec3(0.5, 0, 1.26);
    shot.scene.rigid_bodies.push_back(weight);
    shot.material.youngs_modulus = 5e7;
    return shot;
}

// Blocks that fall on one another, break and come to rest.
Shot heap(const Vec3& velocity) {
    Shot shot;
    shot.add_floor();
    for (const double z : {0.02, 0.5, 1.0})
        test::add_body(shot.scene, test::lattice_mesh({{3, 3, 3}, 0.1, 6, 1000, {}}),
                       {Vec3(0.4 * z, 0, z), Quat(Eigen::AngleAxisd(0.3 * z, Vec3::UnitX()))}, velocity);
    shot.material.youngs_modulus = 5e6, shot.material.toughness = 0.2;
    return shot;
}

// But for what sleepers compare with the frame after: there the input is meant as it is said.
FrameState moved(FrameState state) {
    state.rest_conditions.clear();
    return state;
}

void expect_same(const Shot& shot, int frames, const char* what) {
    const auto as_gravity = shot.run(frames, Said::as_gravity);
    for (const Said how : {Said::as_a_force, Said::as_both}) {
        const auto otherwise = shot.run(frames, how);
        int f = 0;
        while (f < frames && moved(as_gravity[f]) == moved(otherwise[f])) ++f;
        EXPECT_EQ(f, frames) << what << ": frame " << f << " is another, said " << static_cast<int>(how);
    }
}

// Contacts, standing loads and the error budget once asked for gravity alone.
TEST(scales, a_force_is_a_way_to_say_gravity) {
    expect_same(loaded_plank(), 48, "a plank");
    expect_same(heap(Vec3(0, 0, -4)), 60, "a heap");
    Shot budget = heap(Vec3(0, 0, -4));
    budget.settings.error_budget = 0.05;
    expect_same(budget, 30, "a heap under a budget");
    Shot hanging = loaded_plank();
    hanging.scene.rigid_bodies.clear(), hanging.settings.error_budget = 0.05;
    expect_same(hanging, 24, "a plank under a budget");
}

// It once swung by 3 cm and 0.35 m/s for ever where only a force pulled.
TEST(scales, a_loaded_plank_rests_whatever_pulls_at_it) {
    Shot plank = loaded_plank();
    plank.settings.substeps = 4, plank.settings.iterations = 1;
    const auto states = plank.run(192, Said::as_a_force);
    double moved = 0, fastest = 0;
    for (size_t i = 0; i < states.back().n_particles(); ++i) {
        moved = std::max(moved, (states.back().position[i] - states[states.size() - 24].position[i]).norm());
        fastest = std::max(fastest, states.back().velocity[i].norm());
    }
    EXPECT_LE(moved, 2e-5);  // in the last second; it bends by 14 mm
    EXPECT_LE(fastest, 1e-3);
}

TEST(scales, what_is_at_rest_is_slower_than_what_wakes_and_that_than_what_hits) {
    const double g = 9.81, size = 0.1;
    EXPECT_LT(still_speed(size, g, true), still_speed(size, g, false));
    EXPECT_LT(still_speed(size, g, false), waking_speed(size, g));
    EXPECT_LT(waking_speed(size, g), hard_speed(size, g));
    EXPECT_LT(hard_speed(size, g), speed_of_fall(size, g));
    EXPECT_EQ(still_speed(size, 0, false), 0);
}

// A lattice has seven groups of (c h / d)^2 / 2.
TEST(scales, waves_run_as_far_as_their_speed_says) {
    const double E = 3e6, density = 1200, d = 0.05, h = 1e-4, c = wave_speed(E, d * d * d, density * d * d * d);
    EXPECT_NEAR(c, 50, 1e-9);
    const double reach = c * h / d;
    EXPECT_NEAR(waves_in_step(7 * 0.5 * reach * reach), reach, 0.01 * reach);
}

// 2 ms in a fragment of 10 cm of 0.2 MPa; the time that a wave takes is twice as long through what is twice as large,
// and half as long in what is four times as stiff.
TEST(scales, automatic_damping_goes_by_the_time_of_a_wave) {
    const SimulationMesh mesh = test::lattice_mesh({{3, 3, 3}, 0.1, 6, 1000, {}});
    const double soft = automatic_damping_time(mesh, 2e5);
    EXPECT_NEAR(soft, 0.3 * 0.1 / std::sqrt(200.0), 1e-12);
    EXPECT_NEAR(automatic_damping_time(mesh, 8e5), soft / 2, 1e-12);
    EXPECT_NEAR(automatic_damping_time(test::lattice_mesh({{3, 3, 3}, 0.2, 6, 1000, {}}), 2e5), 2 * soft, 1e-12);
    EXPECT_EQ(automatic_damping_time(mesh, 1e-9), kLongestDampingTime);  // and a material takes no more
}

}  // namespace
}  // namespace sunder
