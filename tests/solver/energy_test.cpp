// The forces that a step applies are those of the energy that docs/theory.md states (tests/support/energy.h).
#include "tests/support/energy.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// An irregular body, deformed, flowed and torn at random.
struct Torn {
    Scene scene;
    Material material;
    std::unique_ptr<Solver> solver;
    FrameState state;

    Torn(int neighbours, double poisson_ratio, bool turned_and_flowed) {
        std::mt19937_64 rng(3);
        std::uniform_real_distribution<double> uniform(-1, 1);
        SimulationMesh mesh = test::lattice_mesh({{3, 3, 4}, 0.1, neighbours, 1000, {}});
        for (size_t i = 0; i < mesh.n_particles(); ++i) {
            mesh.rest_position[i] += 0.015 * Vec3(uniform(rng), uniform(rng), uniform(rng));
            mesh.radii[i] += 0.02 * Vec3(uniform(rng), uniform(rng), uniform(rng));
            mesh.volume[i] *= 1 + 0.3 * uniform(rng), mesh.mass[i] = 1000 * mesh.volume[i];
        }
        for (Edge& e : mesh.edges) e.area *= 1 + 0.9 * uniform(rng);
        test::add_body(scene, mesh);
        material.youngs_modulus = 1e6, material.poisson_ratio = poisson_ratio, material.damping_time = 0;
        material.curvature = false;  // a block, though interfaces as small as these would make some groups thin
        solver = test::make_solver(scene);
        state = solver->initial_state({material});
        for (size_t i = 0; i < state.n_particles(); ++i) {
            state.position[i] += 0.005 * Vec3(uniform(rng), uniform(rng), uniform(rng));
            state.position[i].z() *= 1.1;
            if (!turned_and_flowed) continue;
            state.orientation[i] = rotation_of(0.1 * Vec3(uniform(rng), uniform(rng), uniform(rng)));
            const double stretch = 1 + 0.2 * uniform(rng);
            state.plastic_deformation[i] = Vec3(stretch, 1, 1 / stretch).asDiagonal();
        }
        for (size_t e = 0; e < state.edge_intact.size(); ++e) state.edge_intact[e] = uniform(rng) < 0.7;
    }
    double elastic(const FrameState& s) const {
        return test::energy(solver->scene(), material, Vec3::Zero(), s).elastic;
    }
};

// Largest difference of force and slope, over the largest force.
double difference(const Torn& torn) {
    constexpr double h = 1e-7, step = 1e-6;  // s, m
    FrameState after = torn.state;
    SolverSettings settings;
    settings.substeps = settings.iterations = 1, settings.self_collision = false;
    test::advance(*torn.solver, test::quiet_input(torn.scene, torn.material, h), settings, after);
    double most = 0, apart = 0;
    for (size_t i = 0; i < torn.state.n_particles(); ++i)
        for (int axis = 0; axis < 3; ++axis) {
            FrameState moved = torn.state;
            moved.position[i](axis) += step;
            const double up = torn.elastic(moved);
            moved.position[i](axis) -= 2 * step;
            const double slope = (up - torn.elastic(moved)) / (2 * step);
            const double force = torn.scene.rest.mass[i] * after.velocity[i](axis) / h;
            most = std::max(most, std::abs(force)), apart = std::max(apart, std::abs(force + slope));
        }
    return apart / most;
}

TEST(elastic_energy, its_slope_is_the_force_of_a_step) {
    for (const int neighbours : {6, 26}) {
        const double plain = difference(Torn(neighbours, 0, false)), all = difference(Torn(neighbours, 0, true)),
                     pressed = difference(Torn(neighbours, 0.3, true));
        std::printf(
            "%d neighbours: slope and force differ by %.1e of the largest force, turned and flowed %.1e, with "
            "pressure %.1e\n",
            neighbours, plain, all, pressed);
        EXPECT_LE(plain, 1e-5);
        EXPECT_LE(all, 1e-5);
        EXPECT_LE(pressed, 5e-3);  // the pressure's own share in how a group turns is left out of its force
    }
}

}  // namespace
}  // namespace sunder
