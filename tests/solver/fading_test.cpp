// Edges that fade by a fracture energy.
#include "solver/material/fading.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "solver/matching/group_energy.h"
#include "solver/scene/scales.h"
#include "tests/support/energy.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// What an edge takes from its toughness on, until it is parted: stress by opening, over its area.
TEST(Fading, an_edge_takes_the_fracture_energy) {
    Material m;
    m.youngs_modulus = 1e8;
    for (const double G_c : {1.0, 50.0, 2000.0}) {
        m.fracture_energy = G_c;
        const double tau = 0.003, d0 = 0.1, length = opening_length(m, tau), end = tau * (1 + length / d0);
        EXPECT_EQ(damage(tau, tau, length, d0), 0);
        EXPECT_EQ(damage(end, tau, length, d0), 1);
        double work = 0, last = 0;
        constexpr int kParts = 20000;
        for (int k = 0; k < kParts; ++k) {
            const double e = tau + (end - tau) * (k + 0.5) / kParts, d = damage(e, tau, length, d0);
            EXPECT_GE(d, last);
            last = d;
            work += m.youngs_modulus * (1 - d) * e * d0 * (end - tau) / kParts;
        }
        EXPECT_NEAR(work, G_c, 0.01 * G_c);  // what is left at the end is parted at once
    }
}

TEST(Fading, goes_on_from_the_tension_that_made_its_damage) {
    constexpr double tau = 0.01;
    for (const double opening : {0.0, 1e-3, 0.1, 10.0, kNever})
        for (const double d0 : {0.01, 0.1})
            for (const double had : {0.0, 0.3, 0.7, 0.97}) {
                const double from = fading_tension(had, tau, opening, d0);
                EXPECT_GT(damage(from * (1 + 1e-6), tau, opening, d0), had) << opening << " " << had;
                EXPECT_LE(damage(from * (1 - 1e-6), tau, opening, d0), had) << opening << " " << had;
            }
}

TEST(Fading, without_a_fracture_energy_an_edge_parts_at_its_toughness) {
    EXPECT_EQ(damage(0.00999, 0.01, 0, 0.1), 0);
    EXPECT_EQ(damage(0.01001, 0.01, 0, 0.1), 1);
}

// A bar is pulled along z. An edge bears the stress across it; one at right angles to the pull bears none.
TEST(Fading, an_edge_bears_the_tension_across_it) {
    for (const double nu : {0.0, 0.3}) {
        const double strain = 0.01;
        const Mat3 E = Vec3(-nu * strain, -nu * strain, strain).asDiagonal();
        for (const double angle : {0.0, 30.0, 60.0, 90.0}) {
            const double a = angle * std::numbers::pi / 180;
            StretchedEdge edge;
            edge.rest = 0.1 * Vec3(std::sin(a), 0, std::cos(a));
            edge.present = (Mat3::Identity() + E) * edge.rest;
            const GroupStretch stretch{.mean = E};
            EXPECT_NEAR(tension(edge, stretch, stretch, nu, 0), strain * std::cos(a), 1e-12) << angle;
        }
    }
}

// Rings feel a mean; an edge that is stretched more than they are bears more.
TEST(Fading, an_edge_bears_its_own_stretch) {
    StretchedEdge edge;
    edge.rest = Vec3(0, 0, 0.1), edge.present = Vec3(0, 0, 0.102);
    EXPECT_NEAR(tension(edge, {}, {}, 0, 0), 0.02, 1e-12);
    EXPECT_EQ(tension(edge, {}, {}, 0, 0.03), 0) << "no stress of it comes so far";
    edge.present = Vec3(0, 0, 0.098);
    EXPECT_TRUE(edge.is_pressed());
    EXPECT_EQ(tension(edge, {}, {}, 0, 0), 0);
}

// A body is pulled along x and pressed twice as much along z: edges aslant are shortened, and bear the pull all the
// same.
TEST(Fading, what_presses_along_a_crack_does_not_hold_it) {
    const double pull = 0.01;
    const Mat3 E = Vec3(pull, 0, -2 * pull).asDiagonal();
    const GroupStretch stretch{.mean = E};
    for (const double angle : {40.0, 60.0}) {
        const double a = angle * std::numbers::pi / 180;
        StretchedEdge edge;
        edge.rest = 0.1 * Vec3(std::cos(a), 0, std::sin(a));
        edge.present = (Mat3::Identity() + E) * edge.rest;
        EXPECT_TRUE(edge.is_pressed()) << angle;
        EXPECT_NEAR(tension(edge, stretch, stretch, 0, 0), pull * std::cos(a), 1e-12) << angle;
    }
}

// An edge along x moves across a sheet that is thin along z: its faces are strained as a clamped beam's, and nothing
// shears. What moves in the sheet's plane, and in a solid, shears.
TEST(Fading, what_moves_across_a_sheet_strains_its_faces) {
    const double d0 = 0.1, part = 0.01;
    const GroupStretch solid;
    GroupStretch sheet;
    StretchedEdge edge;
    edge.rest = d0 * Vec3::UnitX();
    for (const double thickness : {0.002, 0.01, 0.02}) {
        sheet.extent.z() = thickness;
        edge.present = edge.rest + part * d0 * Vec3::UnitZ();
        EXPECT_NEAR(tension(edge, sheet, sheet, 0, 0), 3 * thickness / d0 * part, 1e-12) << thickness;
        EXPECT_NEAR(tension(edge, solid, solid, 0, 0), part * std::numbers::sqrt2 / 2, 1e-12);
        edge.present = edge.rest + part * d0 * Vec3::UnitY();
        EXPECT_NEAR(tension(edge, sheet, sheet, 0, 0), part * std::numbers::sqrt2 / 2, 1e-12) << thickness;
    }
}

// The energy that the books are kept in is that of theory.md, damaged and flowed as well.
TEST(Fading, the_energy_of_a_group_is_that_of_theory) {
    Scene scene = test::lattice_scene({.cells = {3, 4, 5}, .neighbours = 26});
    Material m;
    m.poisson_ratio = 0.3, m.fracture_energy = 10, m.toughness = 0.01;
    const auto solver = test::make_solver(scene);
    const SimulationMesh& rest = solver->scene().rest;
    FrameState state = solver->initial_state({m});
    std::mt19937_64 rng(3);
    std::uniform_real_distribution<double> noise(-1, 1);
    const auto random = [&] {
        const double x = noise(rng), y = noise(rng);
        return Vec3(x, y, noise(rng));
    };
    for (Vec3& x : state.position) x += 0.003 * random();
    for (Quat& q : state.orientation) q = (rotation_of(0.1 * random()) * q).normalized();
    for (Mat3& F : state.plastic_deformation) F(0, 0) = 1.1, F(1, 1) = 1 / 1.1;
    for (size_t e = 0; e < state.edge_hold.size(); ++e) state.edge_hold[e] = 0.5 + 0.5 * std::abs(noise(rng));
    for (double& k : state.stiffness_factor) k = 1 + std::abs(noise(rng));
    LiveModel model;
    const WorkerPool workers(1);
    model.synchronise(rest, state, workers);
    model.take_up_materials(rest, std::vector{m}, state, true, workers);
    std::vector<MovingParticle> moving(state.n_particles());
    for (size_t i = 0; i < moving.size(); ++i) {
        moving[i].x = state.position[i];
        moving[i].d = state.orientation[i] * rest.rest_orientation[i].conjugate();
    }
    for (uint32_t g = 0; g < state.n_particles(); ++g) {
        const double wanted = test::detail::elastic_energy(rest, m, state, g);
        EXPECT_NEAR(GroupEnergy(model, g).at(moving, Quat::Identity()), wanted, 1e-9 * wanted) << g;
    }
}

// A block of 6 x 6 x 6 falls on an edge.
struct Fall {
    Scene scene = test::lattice_scene({.cells = {6, 6, 6}, .spacing = 0.1, .neighbours = 26, .density = 2000});
    Material material;
    SolverSettings settings;

    explicit Fall(double load, double length) {
        const Quat turn(Eigen::AngleAxisd(0.6, Vec3(1, 0.5, 0).normalized()));
        for (Vec3& x : scene.rest.rest_position) x = turn * x + Vec3(0, 0, 0.6);
        for (Quat& q : scene.rest.rest_orientation) q = turn * q;
        scene.bodies[0].velocity = Vec3(0, 0, -8);
        scene.colliders.push_back({"floor", {ShapeKind::plane}});
        material.youngs_modulus = 5e7, material.poisson_ratio = 0.2, material.damping_time = 1e-4;
        material.toughness = 8 / (std::sqrt(5e7 / 2000) * load);
        material.fracture_energy = material.youngs_modulus * material.toughness * material.toughness * length / 2;
        settings.substeps = 16, settings.iterations = 1, settings.hit_substeps = 64;
    }
    FrameInput input() const {
        FrameInput in = test::quiet_input(scene, material);
        in.gravity = Vec3(0, 0, -9.81);
        return in;
    }
};

TEST(Fading, a_fall_that_breaks_a_block_gains_no_energy) {
    for (const double load : {8.0, 14.0}) {
        const Fall fall(load, 0.1);
        const auto solver = test::make_solver(fall.scene);
        FrameState state = solver->initial_state({fall.material});
        const FrameInput in = fall.input();
        const auto energy = [&] { return test::energy(solver->scene(), fall.material, in.gravity, state).total(); };
        const double start = energy();
        double taken = 0, most = 0;
        for (int frame = 0; frame < 12; ++frame) {
            const auto report = solver->advance(in, fall.settings, state);
            ASSERT_TRUE(report) << report.error().text();
            EXPECT_GE(report->cracks_J, 0);
            taken += report->cracks_J;
            most = std::max(most, energy() + taken);
        }
        EXPECT_GT(taken, 0.001 * start);
        // A contact's work is taken along the straight path of a step (random_shots).
        EXPECT_LE(most, 1.01 * start) << load;
        EXPECT_GT(test::count_broken(state), 0u);
        for (size_t e = 0; e < state.edge_damage.size(); ++e) {
            EXPECT_LE(state.edge_hold[e], 1 - state.edge_damage[e]);
            EXPECT_TRUE(state.edge_intact[e] || state.edge_damage[e] == 1) << e;
        }
    }
}

TEST(Fading, goes_on_from_any_frame_with_the_same_bits_for_any_number_of_threads) {
    const Fall fall(12, 0.1);
    const FrameInput in = fall.input();
    std::vector<FrameState> states;
    {
        const auto solver = test::make_solver(fall.scene);
        FrameState state = solver->initial_state({fall.material});
        for (int frame = 0; frame < 10; ++frame) {
            ASSERT_TRUE(solver->advance(in, fall.settings, state));
            states.push_back(state);
        }
        EXPECT_GT(test::count_broken(state), 0u);
    }
    for (size_t from = 0; from + 1 < states.size(); from += 2) {
        const auto solver = test::make_solver(fall.scene, 2);
        FrameState state = states[from];
        ASSERT_TRUE(solver->advance(in, fall.settings, state));
        EXPECT_EQ(state_hash(state), state_hash(states[from + 1])) << from;
    }
}

// Groups are crushed, and edges fade: an edge is parted once.
TEST(Fading, goes_with_groups_that_are_crushed) {
    Fall fall(14, 0.1);
    fall.material.compressive_toughness = fall.material.toughness;
    const auto solver = test::make_solver(fall.scene);
    FrameState state = solver->initial_state({fall.material});
    for (int frame = 0; frame < 6; ++frame) ASSERT_TRUE(solver->advance(fall.input(), fall.settings, state));
    EXPECT_GT(test::count_broken(state), 0u);
    for (size_t e = 0; e < state.edge_intact.size(); ++e)
        EXPECT_TRUE(state.edge_intact[e] || state.edge_damage[e] == 1) << e;
}

// A bar is drawn apart: however tough, what is stretched beyond its end parts.
TEST(Fading, the_toughest_edge_parts_at_its_end) {
    Scene scene = test::lattice_scene({.cells = {1, 1, 2}, .spacing = 0.1});
    Material m;
    m.youngs_modulus = 1e6, m.toughness = 1e-4, m.curvature = false;
    m.fracture_energy = m.youngs_modulus * 1e-8 * 100 / 2;  // L 100 m, a thousand times the edge
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({m});
    for (const double stretch : {0.05, 0.09, 0.0975, 0.2}) {
        state.position[1] = state.position[0] + Vec3(0, 0, 0.1 * (1 + stretch));
        std::ranges::fill(state.velocity, Vec3::Zero());
        ASSERT_TRUE(solver->advance(test::quiet_input(scene, m, 1e-9), {.substeps = 1}, state));
    }
    EXPECT_EQ(test::count_broken(state), 1u);
}

// Stored strain asks for parts where it rings, not where it bears a load.
TEST(Fading, a_load_at_rest_takes_no_parts) {
    Scene scene = test::lattice_scene({.cells = {3, 3, 4}, .spacing = 0.1, .neighbours = 26, .density = 2000});
    scene.colliders.push_back({"floor", {ShapeKind::plane}});
    Material m;
    m.youngs_modulus = 5e7, m.poisson_ratio = 0, m.damping_time = 1e-3, m.toughness = 1.4e-4;
    m.fracture_energy = m.youngs_modulus * 2e-8 * 1e-3 / 2;  // L 1 mm
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({m});
    FrameInput in = test::quiet_input(scene, m);
    in.gravity = Vec3(0, 0, -9.81);
    SolverSettings settings;
    settings.substeps = 32, settings.sleeping = false;
    int substeps = 0;
    for (int frame = 0; frame < 30; ++frame) substeps = test::advance(*solver, in, settings, state).substeps;
    EXPECT_GT(std::ranges::max(state.strain), 0.55 * m.toughness);
    EXPECT_EQ(substeps, settings.substeps);
}

// The paper's rule, of other methods and of bodies without a fracture energy, knows of nothing between sound and
// parted.
TEST(Fading, by_other_methods_and_without_it_edges_are_sound_or_parted) {
    Fall fall(12, 0.1);
    fall.settings.method = Method::jacobi;
    const auto solver = test::make_solver(fall.scene);
    FrameState state = solver->initial_state({fall.material});
    for (int frame = 0; frame < 4; ++frame) ASSERT_TRUE(solver->advance(fall.input(), fall.settings, state));
    for (size_t e = 0; e < state.edge_intact.size(); ++e)
        EXPECT_EQ(state.edge_damage[e], state.edge_intact[e] ? 0 : 1) << e;
    fall.material.fracture_energy = kNever;
    EXPECT_TRUE(solver->initial_state({fall.material}).edge_damage.empty());
}

}  // namespace
}  // namespace sunder
