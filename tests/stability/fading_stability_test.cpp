// Edges that fade, at the ends of what may be asked for: a fracture energy near zero and huge, 2 to 512 substeps a
// frame, bars under load with a notch. Nothing may fail, gain energy, or fly faster than what drives it.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/energy.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

constexpr double kStiffness = 5e7, kDensity = 2000;  // Pa, kg/m3
const double kWaves = std::sqrt(kStiffness / kDensity);
// A contact's work is taken along the straight path of a step (random_shots).
constexpr double kPathError = 0.01;

struct Shot {
    Scene scene;
    Material material;
    SolverSettings settings;
    FrameInput input;
};

struct Outcome {
    size_t broken = 0;
    double gained = 0;   // energy, with what cracks took, over that of the start
    double taken = 0;    // by cracks, over the energy of the start
    double fastest = 0;  // m/s
};

Outcome run(const Shot& shot, int frames, const std::function<void(FrameState&)>& prepare = {}) {
    const auto solver = test::make_solver(shot.scene);
    FrameState state = solver->initial_state({shot.material});
    if (prepare) prepare(state);
    const auto energy = [&] { return test::energy(solver->scene(), shot.material, shot.input.gravity, state).total(); };
    const double start = energy();
    Outcome of;
    for (int frame = 0; frame < frames; ++frame) {
        const StepReport report = test::advance(*solver, shot.input, shot.settings, state);
        EXPECT_GE(report.cracks_J, 0);
        of.taken += report.cracks_J / start;
        of.gained = std::max(of.gained, energy() / start + of.taken - 1);
        for (const Vec3& v : state.velocity) of.fastest = std::max(of.fastest, v.norm());
    }
    of.broken = test::count_broken(state);
    for (const double d : state.edge_damage) EXPECT_TRUE(d >= 0 && d <= 1) << d;
    for (const double k : state.stiffness_factor) EXPECT_TRUE(k > 0 && k < kNever) << k;
    return of;
}

Material brittle(double toughness) {
    Material m;
    m.youngs_modulus = kStiffness, m.poisson_ratio = 0.2, m.damping_time = 1e-4, m.toughness = toughness;
    m.fracture_energy = kStiffness * toughness * toughness * 0.1 / 2;  // L 0.1 m
    return m;
}

constexpr double kSpeed = 8;  // m/s

// A block of 6 x 6 x 6 that falls on an edge of it, 14 times as fast as what strains it by its toughness.
Shot fall() {
    Shot shot;
    shot.scene = test::lattice_scene({.cells = {6, 6, 6}, .spacing = 0.1, .neighbours = 26, .density = kDensity});
    const Quat turn(Eigen::AngleAxisd(0.6, Vec3(1, 0.5, 0).normalized()));
    for (Vec3& x : shot.scene.rest.rest_position) x = turn * x + Vec3(0, 0, 0.6);
    for (Quat& q : shot.scene.rest.rest_orientation) q = turn * q;
    shot.scene.bodies[0].velocity = Vec3(0, 0, -kSpeed);
    shot.scene.colliders.push_back({"floor", {ShapeKind::plane}});
    shot.material = brittle(kSpeed / (14 * kWaves));
    shot.settings.substeps = 16, shot.settings.iterations = 1, shot.settings.hit_substeps = 64;
    shot.input = test::quiet_input(shot.scene, shot.material);
    shot.input.gravity = Vec3(0, 0, -9.81);
    return shot;
}

// What has come off recoils from the floor at v; the rest, which still comes at v, then throws what is light at 3 v at
// most.
void expect_sound(const Outcome& of, const std::string& what) {
    std::printf("%s: %zu edges broken, %.4f gained, cracks took %.3f, fastest %.1f m/s\n", what.c_str(), of.broken,
                of.gained, of.taken, of.fastest);
    EXPECT_LE(of.gained, kPathError) << what;
    EXPECT_LE(of.fastest, 3 * kSpeed) << what;
}

TEST(fading, gains_nothing_by_any_fracture_energy) {
    const double own = fall().material.fracture_energy, most = std::numeric_limits<double>::max();
    size_t broken = kNone;
    for (const double energy : {0.0, 1e-300, 1e-9, 0.1 * own, own, 10 * own, 1e3 * own, 1e12, most}) {
        Shot shot = fall();
        shot.material.fracture_energy = shot.input.materials[0].fracture_energy = energy;
        const Outcome of = run(shot, 5);
        std::printf("%g J/m2 ", energy);
        expect_sound(of, "as fracture energy");
        EXPECT_LE(of.broken, 1.1 * double(broken)) << "what takes more to part parts less";
        EXPECT_TRUE(energy < 1e3 * own || of.broken == 0) << energy;
        broken = of.broken;
    }
}

TEST(fading, gains_nothing_in_steps_of_any_length) {
    for (const int parts : {16, 1})
        for (const int substeps : {2, 8, 32, 128, 512}) {
            if (parts == 1 && substeps > 128) continue;  // so short that hits take no parts
            Shot shot = fall();
            shot.settings.substeps = substeps, shot.settings.hit_substeps = parts;
            expect_sound(run(shot, 5), std::to_string(substeps) + " substeps, hits in " + std::to_string(parts));
        }
}

// Between two pins, drawn to a share of its toughness, with a notch across the middle from above: it breaks at once.
struct NotchedBar : Shot {
    static constexpr int kLong = 24, kWide = 3, kHigh = 6;
    static constexpr double kSpacing = 0.05, kHeld = 2 * kSpacing, kHalf = kLong / 2 * kSpacing;
    double strain;
    int depth;  // of the notch, layers

    NotchedBar(double load, int layers) : strain(load * 0.01), depth(layers) {
        scene = test::lattice_scene(
            {.cells = {kLong, kWide, kHigh}, .spacing = kSpacing, .neighbours = 26, .density = kDensity});
        test::add_pin(scene, [](const Vec3& x) { return x.x() < kHeld - kHalf; });
        test::add_pin(scene, [](const Vec3& x) { return x.x() > kHalf - kHeld; });
        material = brittle(0.01);
        input = test::quiet_input(scene, material);
        for (const int side : {0, 1})
            input.pins[side].begin.position = input.pins[side].end.position = Vec3(drawn(side ? kHalf : -kHalf), 0, 0);
    }
    double drawn(double x) const { return strain * std::clamp(x, kHeld - kHalf, kHalf - kHeld); }
    void start(FrameState& o_state) const {
        const SimulationMesh& rest = scene.rest;
        for (Vec3& x : o_state.position) x.x() += drawn(x.x());
        for (size_t e = 0; e < o_state.edge_intact.size(); ++e) {
            const Vec3 &a = rest.rest_position[rest.edges[e].a], &b = rest.rest_position[rest.edges[e].b];
            if (a.x() * b.x() < 0 && std::max(a.z(), b.z()) > (kHigh - depth) * kSpacing)
                o_state.edge_intact[e] = 0, o_state.edge_damage[e] = 1;
        }
    }
};

TEST(fading, of_a_drawn_bar_with_a_notch_gains_nothing) {
    for (const int depth : {1, 3})
        for (const double load : {0.4, 0.9})
            for (const int substeps : {2, 32, 512}) {
                NotchedBar bar(load, depth);
                bar.settings.substeps = substeps;
                const Outcome of = run(bar, 2, [&](FrameState& s) { bar.start(s); });
                const double recoil = of.fastest / (bar.strain * kWaves);
                std::printf(
                    "notch of %d in 6, drawn to %.1f, %d substeps: %zu edges broken, %.5f gained, cracks took %.3f, "
                    "fastest %.2f times c strain\n",
                    depth, load, substeps, of.broken, of.gained, of.taken, recoil);
                EXPECT_LE(of.gained, 1e-3);  // nothing touches it
                EXPECT_LE(recoil, 2);        // a wave and what it throws back
            }
}

}  // namespace
}  // namespace sunder
