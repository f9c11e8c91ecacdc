#include "solver/solver.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "solver/scene/motion.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

using test::advance;

// A ductile bar pulled apart: everything happens in it but contacts.
struct PulledBar {
    Scene scene = test::lattice_scene({});
    Material material;
    SolverSettings settings;

    PulledBar() {
        test::add_pin(scene, [](const Vec3& x) { return x.z() < 0.1; });
        test::add_pin(scene, [](const Vec3& x) { return x.z() > 0.9; });
        material.youngs_modulus = 2e5;
        material.yield = 0.05;
        material.flow_rate = 1;
        material.toughness = 0.15;
        settings.substeps = 8;
    }
    FrameInput input(int frame, double speed = 0.5) const {
        FrameInput in = test::quiet_input(scene, material);
        in.pins[1].begin.position.z() = speed * frame / 24;
        in.pins[1].end.position.z() = speed * (frame + 1) / 24;
        return in;
    }
};

TEST(solver, thread_count_does_not_change_a_bit) {
    const PulledBar bar;
    uint64_t reference = 0;
    for (int threads : {1, 2, 4}) {
        const auto solver = test::make_solver(bar.scene, threads);
        FrameState state = solver->initial_state({bar.material});
        for (int f = 0; f < 24; ++f) advance(*solver, bar.input(f), bar.settings, state);
        if (threads == 1) reference = state_hash(state);
        EXPECT_EQ(state_hash(state), reference) << threads << " threads";
        EXPECT_GT(test::count_broken(state), 0u);
    }
}

// Frames of far less than a trial's longest, so that there are trials on any machine.
TEST(solver, frames_that_do_without_other_threads_have_the_same_bits) {
    PulledBar bar;
    bar.settings.substeps = 2;
    std::vector<uint64_t> hashes;
    for (const int threads : {1, 3}) {
        auto solver = Solver::create(bar.scene, std::make_shared<const WorkerPool>(threads));
        ASSERT_TRUE(solver);
        FrameState state = (*solver)->initial_state({bar.material});
        for (int f = 0; f < 48; ++f) advance(**solver, bar.input(f), bar.settings, state);
        EXPECT_GT(test::count_broken(state), 0u);
        hashes.push_back(state_hash(state));
    }
    EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(solver, every_instruction_set_gives_the_same_bits) {
    for (const Method method : {Method::projective, Method::jacobi}) {
        PulledBar bar;
        bar.settings.method = method;
        FrameState best;
        for (const char* most : {"", "avx2", "portable"}) {
            setenv("SUNDER_INSTRUCTIONS", most, 1);
            const auto solver = test::make_solver(bar.scene);
            FrameState state = solver->initial_state({bar.material});
            for (int f = 0; f < 16; ++f) advance(*solver, bar.input(f), bar.settings, state);
            unsetenv("SUNDER_INSTRUCTIONS");
            if (best.position.empty()) best = state;
            EXPECT_TRUE(state == best) << most;
            EXPECT_EQ(state_hash(state), state_hash(best)) << most;
        }
    }
}

// Bodies that break on the floor and on one another: the kernels that look for contacts and those that solve them.
TEST(solver, every_instruction_set_and_thread_count_gives_the_same_bits_in_a_heap) {
    Scene scene;
    for (int k = 0; k < 4; ++k) {
        Pose place;
        place.position = Vec3(0.13 * (k % 2), 0.11 * (k / 2), 0.1 + 0.36 * k);
        place.orientation = rotation_of(Vec3(0.3 * k, 0.2, 0.5 - 0.4 * k));
        test::add_body(scene, test::lattice_mesh({{6, 6, 6}, 0.05, 6, 1000, {}}), place, Vec3(0, 0, -6));
    }
    scene.colliders.push_back({"floor", {ShapeKind::plane}, 0.6, 0.0});
    Material clay;
    clay.youngs_modulus = 2e5, clay.yield = 0.02, clay.toughness = 0.04;
    FrameInput input = test::quiet_input(scene, clay);
    input.gravity = FrameInput().gravity;
    SolverSettings settings;
    settings.substeps = 2;
    FrameState first;
    for (const auto& [threads, instructions] : {std::pair(1, ""), {3, ""}, {1, "avx2"}, {1, "portable"}}) {
        if (*instructions) setenv("SUNDER_INSTRUCTIONS", instructions, 1);
        const auto solver = test::make_solver(scene, threads);
        FrameState state = solver->initial_state(input.materials);
        size_t contacts = 0;
        for (int f = 0; f < 14; ++f) contacts += advance(*solver, input, settings, state).contacts;
        unsetenv("SUNDER_INSTRUCTIONS");
        if (first.position.empty()) first = state;
        EXPECT_TRUE(state == first) << threads << " threads " << instructions;
        EXPECT_GT(contacts, 14 * 200u);
        EXPECT_GT(test::count_pieces(scene.rest, state), 20u);
    }
}

TEST(solver, continuing_from_a_saved_state_gives_the_same_bits) {
    const PulledBar bar;
    const auto solver = test::make_solver(bar.scene);
    FrameState state = solver->initial_state({bar.material}), saved;
    for (int f = 0; f < 20; ++f) {
        if (f == 11) saved = state;
        advance(*solver, bar.input(f), bar.settings, state);
    }
    const auto fresh = test::make_solver(bar.scene);
    for (int f = 11; f < 20; ++f) advance(*fresh, bar.input(f), bar.settings, saved);
    EXPECT_TRUE(saved == state);
    EXPECT_EQ(state_hash(saved), state_hash(state));
}

// In place or beside the frame before, whatever stood there.
TEST(solver, the_frame_before_may_be_kept) {
    const PulledBar bar;
    const auto solver = test::make_solver(bar.scene), other = test::make_solver(bar.scene);
    FrameState state = solver->initial_state({bar.material}), before = state, after;
    for (int f = 0; f < 12; ++f) {
        const uint64_t was = state_hash(before);
        ASSERT_TRUE(other->advance(bar.input(f), bar.settings, before, after));
        EXPECT_EQ(state_hash(before), was);
        advance(*solver, bar.input(f), bar.settings, state);
        ASSERT_TRUE(after == state) << "frame " << f;
        std::swap(before, after);
    }
}

// When this changes, the physics did: say in the commit what.
TEST(solver, golden_hash_of_a_pulled_bar) {
    PulledBar bar;
    bar.settings.sleeping = false;
    const auto solver = test::make_solver(bar.scene);
    FrameState state = solver->initial_state({bar.material});
    for (int f = 0; f < 16; ++f) advance(*solver, bar.input(f), bar.settings, state);
    EXPECT_EQ(state_hash(state), 0x63306a7e5672a882ull) << std::hex << state_hash(state);
}

TEST(solver, a_body_at_rest_stays_at_rest) {
    for (Method method : {Method::projective, Method::gauss_seidel}) {
        Scene scene = test::lattice_scene({});
        const Material material;
        const auto solver = test::make_solver(scene);
        FrameState state = solver->initial_state({material});
        SolverSettings settings;
        settings.method = method;
        for (int f = 0; f < 24; ++f) advance(*solver, test::quiet_input(scene, material), settings, state);
        for (size_t i = 0; i < state.n_particles(); ++i) {
            EXPECT_LE((state.position[i] - scene.rest.rest_position[i]).norm(),
                      1e-12);  // rounding of a metre-sized body
            EXPECT_LE(state.velocity[i].norm(), 1e-10);
        }
    }
}

TEST(solver, a_soft_body_falls_along_the_parabola) {
    Scene scene = test::lattice_scene({});
    const Material material;
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({material});
    FrameInput input = test::quiet_input(scene, material);
    input.gravity = Vec3(0, 0, -9.81);
    const SolverSettings settings;
    for (int f = 0; f < 24; ++f) advance(*solver, input, settings, state);
    for (size_t i = 0; i < state.n_particles(); ++i) {
        const Vec3 fall = state.position[i] - scene.rest.rest_position[i];
        EXPECT_NEAR(fall.z(), -9.81 / 2, 1e-9);
        EXPECT_NEAR(state.velocity[i].z(), -9.81, 1e-8);
    }
}

TEST(solver, a_bad_input_or_cancel_leaves_the_state_as_it_was) {
    const PulledBar bar;
    const auto solver = test::make_solver(bar.scene);
    FrameState state = solver->initial_state({bar.material});
    advance(*solver, bar.input(0), bar.settings, state);
    const FrameState before = state;

    FrameInput wrong = bar.input(1);
    wrong.materials[0].youngs_modulus = -1;
    const auto refused = solver->advance(wrong, bar.settings, state);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
    EXPECT_NE(refused.error().text().find("youngs_modulus"), std::string::npos);

    const Progress::Callback stop = [](double fraction, std::string_view) { return fraction < 0.5; };
    const auto stopped = solver->advance(bar.input(1), bar.settings, state, Progress(stop));
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
    EXPECT_TRUE(state == before);

    FrameState unbroken = before;  // and it goes on as if nothing had happened
    advance(*solver, bar.input(1), bar.settings, state);
    advance(*test::make_solver(bar.scene), bar.input(1), bar.settings, unbroken);
    EXPECT_TRUE(state == unbroken);
}

TEST(solver, numbers_gone_bad_are_reported_with_the_particle_and_not_spread) {
    const PulledBar bar;
    const auto solver = test::make_solver(bar.scene);
    FrameState state = solver->initial_state({bar.material});
    state.velocity[77] = Vec3(0, 0, 1e9);
    const FrameState before = state;
    const auto result = solver->advance(bar.input(0), bar.settings, state);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::numerical);
    EXPECT_NE(result.error().text().find("particle "), std::string::npos);
    EXPECT_TRUE(state == before);

    state.velocity[77] = Vec3(std::nan(""), 0, 0);
    const auto refused = solver->advance(bar.input(0), bar.settings, state);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().text().find("velocity of particle 77"), std::string::npos);
}

TEST(solver, momentum_far_from_the_origin_is_kept) {
    test::LatticeBody body;
    body.pose.position = Vec3(60, -80, 0);
    Scene scene = test::lattice_scene(body);
    Material material;
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({material});
    for (size_t i = 0; i < state.n_particles(); ++i)  // tumbling and vibrating
        state.velocity[i] = Vec3(0, 0, 2 * M_PI).cross(scene.rest.rest_position[i] - body.pose.position) +
                            Vec3(0.3 * std::sin(double(i)), 0, 0.2);
    auto linear = [&] {
        Vec3 p = Vec3::Zero();
        for (size_t i = 0; i < state.n_particles(); ++i) p += scene.rest.mass[i] * state.velocity[i];
        return p;
    };
    const Vec3 before = linear();
    for (int f = 0; f < 48; ++f) advance(*solver, test::quiet_input(scene, material), {}, state);
    EXPECT_LE((linear() - before).norm(), 1e-9 * (1 + before.norm()));
}

TEST(solver, angular_momentum_is_exact_for_a_tumbling_vibrating_bar) {
    Scene scene = test::lattice_scene({});
    const SimulationMesh& rest = scene.rest;
    Material material;
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({material});
    Vec3 center = Vec3::Zero();
    for (const Vec3& x : rest.rest_position) center += x / double(rest.n_particles());
    for (size_t i = 0; i < state.n_particles(); ++i) {
        const Vec3 r = rest.rest_position[i] - center;
        state.velocity[i] = Vec3(2 * M_PI, 1, 0).cross(r) + 0.5 * r;
        state.angular_velocity[i] = Vec3(2 * M_PI, 1, 0);
    }
    auto angular = [&] {
        Vec3 L = Vec3::Zero(), c = Vec3::Zero();
        double mass = 0;
        for (size_t i = 0; i < state.n_particles(); ++i) c += rest.mass[i] * state.position[i], mass += rest.mass[i];
        c /= mass;
        for (size_t i = 0; i < state.n_particles(); ++i) {
            const Mat3 R = state.orientation[i].toRotationMatrix();
            const Vec3 a = rest.mass[i] / 5 * rest.radii[i].cwiseProduct(rest.radii[i]);
            const Mat3 H = R * (a.sum() * Mat3::Identity() - Mat3(a.asDiagonal())) * R.transpose();
            L += rest.mass[i] * (state.position[i] - c).cross(state.velocity[i]) + H * state.angular_velocity[i];
        }
        return L;
    };
    const Vec3 before = angular();
    for (int f = 0; f < 240; ++f) advance(*solver, test::quiet_input(scene, material), {}, state);
    EXPECT_LE((angular() - before).norm(), 1e-9 * before.norm());  // sums of 320 roundings over 1920 substeps
}

TEST(solver, refuses_scenes_that_cannot_be_simulated) {
    EXPECT_FALSE(Solver::create(Scene()));
    Scene scene = test::lattice_scene({{2, 2, 2}, 0.1, 6, 1000, {}});
    scene.rest.mass[3] = -1;
    const auto result = Solver::create(scene);
    ASSERT_FALSE(result);
    EXPECT_NE(result.error().text().find("particle 3"), std::string::npos);
}

}  // namespace
}  // namespace sunder
