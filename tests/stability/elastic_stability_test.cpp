// Order, steps, inversion, thin bodies, and the elastic field itself (rows 1, 5, 6, 8-11, 24).
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sstream>

#include "tests/stability/bars.h"

namespace sunder {
namespace {

using test::Bar;
using test::kDegree;

TEST(order_bias, a_bar_held_at_a_full_turn_is_in_equilibrium_and_symmetric) {
    Bar bar;
    bar.settings.damping = 3;
    bar.start();
    bar.turn(0, 360 * kDegree, 2);
    bar.hold(360 * kDegree, 6);
    const std::vector<Vec3> settled = bar.state.position;
    bar.hold(360 * kDegree, 2);
    double moved = 0, asymmetry = 0, displacement = 0;
    const SimulationMesh& rest = bar.scene.rest;
    for (size_t i = 0; i < settled.size(); ++i) {
        moved += (settled[i] - bar.state.position[i]).squaredNorm();
        displacement += (bar.state.position[i] - rest.rest_position[i]).squaredNorm();
        // Turned by half about the axis, the bar is itself: particle (x, y) and (-x, -y) of a layer change places.
        const size_t layer = i / 16, opposite = layer * 16 + 15 - i % 16;
        const Vec3 &a = bar.state.position[i], b = bar.state.position[opposite];
        asymmetry += Vec3(a.x() + b.x(), a.y() + b.y(), a.z() - b.z()).squaredNorm();
    }
    EXPECT_LE(std::sqrt(moved / displacement), 1e-6);      // at rest: this is the minimiser
    EXPECT_LE(std::sqrt(asymmetry / displacement), 1e-6);  // no order of groups shows (Gauss-Seidel: 0.04)
}

TEST(stiffness, the_half_period_of_a_released_twist_is_that_of_the_material) {
    // The limit for fine steps, by 40 times the default rate; then the defaults.
    std::vector<double> half_periods;
    for (int substeps : {160, 8}) {
        Bar bar(4, 6);
        bar.material.youngs_modulus = 6e5;
        bar.start();
        bar.settings.damping = 5;
        bar.turn(0, 60 * kDegree, 1);
        bar.hold(60 * kDegree, 3);
        bar.settings.damping = 0;
        bar.settings.substeps = 1;
        double last = bar.twist(), zero = -1;
        const double h = 1.0 / 24 / substeps, start = bar.state.time;
        for (int f = 0; f < 24 * substeps && zero < 0; ++f) {
            bar.frame(h, {}, {}, false);
            const double now = bar.twist();
            if (now <= 0) zero = bar.state.time - start - h * (0 - now) / (last - now);  // a quarter period
            last = now;
        }
        half_periods.push_back(2 * zero);
    }
    std::printf("half period: %.4f s in the limit, %.4f s at the defaults\n", half_periods[0], half_periods[1]);
    EXPECT_NEAR(half_periods[1], half_periods[0], 0.05 * half_periods[0]);
}

TEST(inversion, any_crushed_start_comes_back) {
    std::mt19937_64 rng(11);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int kind = 0; kind < 3; ++kind) {  // flattened, point, random
        Bar bar(3, 26);
        bar.scene.pins.clear();
        bar.settings.damping = 4;
        bar.start();
        for (Vec3& x : bar.state.position) {
            if (kind == 0) x.z() *= 1e-6;
            if (kind == 1) x *= 1e-6;
            if (kind == 2) x = 0.3 * Vec3(uniform(rng), uniform(rng), uniform(rng));
        }
        bar.settings.self_collision = false;  // the elastic recovery alone
        const FrameInput in = test::quiet_input(bar.scene, bar.material);
        for (int f = 0; f < 240; ++f) test::advance(*bar.solver, in, bar.settings, bar.state);
        for (const Vec3& x : bar.state.position) ASSERT_TRUE(x.allFinite());
        double strain = 0;
        for (double s : bar.state.strain) strain = std::max(strain, s);
        std::printf("start %d: largest strain left %.2e\n", kind, strain);
        EXPECT_LE(strain, 1e-3);
    }
}

TEST(thin_bodies, plates_rods_pairs_and_single_particles_stay_at_rest) {
    for (const std::array<int, 3>& cells : {std::array{12, 12, 1}, {1, 1, 16}, {2, 1, 1}, {1, 1, 1}}) {
        Scene scene;
        SimulationMesh mesh = test::lattice_mesh({cells, 0.1, 26, 1000, {}});
        for (Vec3& r : mesh.radii) r.setConstant(0.002);  // r/d 0.02
        test::add_body(scene, mesh);
        Material material;
        material.yield = 0.02;
        const auto solver = test::make_solver(scene);
        FrameState state = solver->initial_state({material});
        for (int f = 0; f < 48; ++f) test::advance(*solver, test::quiet_input(scene, material), {}, state);
        for (size_t i = 0; i < state.n_particles(); ++i) {
            EXPECT_LE((state.position[i] - scene.rest.rest_position[i]).norm(), 1e-10);
            EXPECT_LE(state.strain[i], 1e-10);
        }
    }
}

// Mean difference from the finite-element field, relative to the mean displacement (shared reference, nu = 0).
double error_against_reference(int n) {
    Bar bar(n, 6);
    bar.settings.damping = 5;
    bar.start();
    bar.turn(0, 90 * kDegree, 1);
    bar.hold(90 * kDegree, 3);

    std::ifstream file(SUNDER_TEST_DATA "/twist90_neohooke_nu0.00.csv");
    std::string line;
    double difference = 0, displacement = 0;
    int found = 0;
    // The last 256 rows are the centres of the cells of n = 4; for finer lattices the mean of the eight cells around.
    std::vector<std::array<Vec3, 2>> points;
    while (std::getline(file, line)) {
        double X[3], x[3];
        if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf", X, X + 1, X + 2, x, x + 1, x + 2) == 6)
            points.push_back({Vec3(X[0], X[1], X[2]), Vec3(x[0], x[1], x[2])});
    }
    for (size_t k = points.size() - std::min<size_t>(256, points.size()); k < points.size(); ++k) {
        Vec3 mean = Vec3::Zero();
        int cells = 0;
        for (size_t i = 0; i < bar.state.n_particles(); ++i)
            if ((bar.scene.rest.rest_position[i] - points[k][0]).cwiseAbs().maxCoeff() < 0.02)
                mean += bar.state.position[i], ++cells;
        if (cells != (n == 4 ? 1 : 8)) continue;
        difference += (mean / cells - points[k][1]).squaredNorm();
        displacement += (points[k][1] - points[k][0]).squaredNorm();
        ++found;
    }
    EXPECT_EQ(found, 256);
    return std::sqrt(difference / displacement);
}

TEST(field_accuracy, a_twisted_bar_approaches_the_finite_element_field) {
    const double coarse = error_against_reference(4), fine = error_against_reference(8);
    std::printf("L2 error against the reference: %.2f %% at n = 4, %.2f %% at n = 8\n", 100 * coarse, 100 * fine);
    EXPECT_LE(coarse, 0.05);
    EXPECT_LE(fine, 0.025);
    EXPECT_GE(coarse / fine, 1.5);
}

}  // namespace
}  // namespace sunder
