// What touches nothing moves with second order in the substep.
#include <numbers>

#include "tests/accuracy/bar_cases.h"
#include "tests/support/energy.h"

namespace sunder {
namespace {

using namespace test;

// A bar that is bent, stretched and twisted by the velocities it starts with, in flight or drawn by its lower end:
// where it is after two frames.
FrameState after_two_frames(int substeps, bool pinned, double damping_time) {
    Scene scene = lattice_scene({{3, 3, 9}, 0.1, 6, 1000, Pose{Vec3(0, 0, 10), Quat::Identity()}});
    Material material;
    material.youngs_modulus = 1e5, material.damping_time = damping_time;
    if (pinned) add_pin(scene, [](const Vec3& x) { return x.z() < 10.1; });
    const auto solver = make_solver(scene);
    FrameState state = solver->initial_state({material});
    for (size_t i = 0; i < state.n_particles(); ++i) {
        const Vec3 r = scene.rest.rest_position[i] - Vec3(0, 0, 10), twist(0, 0, 2 * r.z());
        state.velocity[i] = Vec3(0.3 * r.z(), -0.2 * r.x(), 0.5 * r.z()) + twist.cross(r);
        state.angular_velocity[i] = twist;
    }
    FrameInput input = quiet_input(scene, material);
    input.gravity = Vec3(0, 0, -9.81);
    SolverSettings settings;
    settings.self_collision = false, settings.substeps = substeps, settings.iterations = 6;
    for (int f = 0; f < 2; ++f) {
        const auto pose = [](int frame) { return Pose{Vec3(0.05 * frame, 0, 0), Quat::Identity()}; };
        if (pinned) input.pins = {{pose(f), pose(f + 1), true}};
        advance(*solver, input, settings, state);
    }
    return state;
}

double distance(const FrameState& a, const FrameState& b) {
    double d = 0;
    for (size_t i = 0; i < a.n_particles(); ++i) d = std::max(d, (a.position[i] - b.position[i]).norm());
    return d;
}

// Largest distance from the limit of fine steps at 4, 8, 16 and 32 substeps, m.
std::vector<double> distances(bool pinned, double damping_time) {
    const FrameState limit = after_two_frames(512, pinned, damping_time);
    std::vector<double> result;
    for (const int substeps : {4, 8, 16, 32}) {
        result.push_back(distance(after_two_frames(substeps, pinned, damping_time), limit));
        std::printf("%s, damping time %.0e s, %d substeps: %.1e m off\n", pinned ? "pinned" : "free", damping_time,
                    substeps, result.back());
    }
    return result;
}

TEST(time_order, is_two_where_nothing_touches) {
    for (const bool pinned : {false, true}) {
        // Over a factor of 8 in the step. Implicit Euler: 4.6e-3 to 6.6e-4 m free, 1.2e-2 to 2.3e-3 pinned, order 0.9.
        const std::vector<double> undamped = distances(pinned, 0);
        EXPECT_GE(std::log2(undamped.front() / undamped.back()) / 3, 1.5);
        // With damping the limit is nearer, and so are coarse steps.
        const std::vector<double> damped = distances(pinned, 2e-3);
        for (size_t i = 0; i < damped.size(); ++i) EXPECT_LE(damped[i], undamped.front() / double(1 << i));
    }
}

// Energy (motion of the centres and of the groups) of a bar, held below and set swinging along its length in its lowest
// mode, after half a second, over what it began with; and the mode's angular frequency.
struct Decay {
    double left, omega;
};
Decay swing(int substeps, double damping_time) {
    Scene scene = lattice_scene({{3, 3, 9}, 0.1, 6, 1000, {}});
    Material material;
    material.youngs_modulus = 1e5, material.damping_time = damping_time;
    add_pin(scene, [](const Vec3& x) { return x.z() < 0.1; });
    const auto solver = make_solver(scene);
    FrameState state = solver->initial_state({material});
    const double spacing = 0.1, phase = std::numbers::pi / 17;  // a layer: eight swing, one is held
    for (size_t i = 0; i < state.n_particles(); ++i)
        state.velocity[i].z() = 0.05 * std::sin(phase * std::floor(scene.rest.rest_position[i].z() / spacing));
    FrameInput input = quiet_input(scene, material);
    input.gravity.setZero();
    input.pins = {{Pose(), Pose(), true}};
    SolverSettings settings;
    settings.self_collision = false, settings.substeps = substeps, settings.iterations = 4;
    const double start = energy(solver->scene(), material, input.gravity, state).total();
    for (int f = 0; f < 12; ++f) advance(*solver, input, settings, state);
    return {energy(solver->scene(), material, input.gravity, state).total() / start,
            2 / spacing * std::sqrt(1e5 / 1000) * std::sin(phase / 2)};
}

// Kelvin and Voigt's damping takes exp(-damping_time omega^2 t) of a mode's energy, whatever the substep: above the
// damping time (10 to 2.6 ms) it is the step's own, below it (1.3 to 0.3 ms) a step of its own.
TEST(damping_time, takes_the_same_of_a_vibration_at_any_substep) {
    for (const double time : {0.0, 2e-3}) {
        const double limit = swing(256, time).left;
        for (const int substeps : {4, 8, 16, 32, 64}) {
            const auto [left, omega] = swing(substeps, time);
            const double rate = -std::log(left) / 0.5, expected = time * omega * omega;
            std::printf("damping time %.0e s, %d substeps: %.4f of the energy left, %.4f in the limit\n", time,
                        substeps, left, limit);
            EXPECT_NEAR(left, limit, 0.01);
            // The start has some of higher modes, which die sooner.
            EXPECT_NEAR(rate, expected, time > 0 ? 0.15 * expected : 0.011);
        }
    }
}

}  // namespace
}  // namespace sunder
