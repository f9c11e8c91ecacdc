// Cases whose answer is known without any other program.
#include "tests/accuracy/bar_cases.h"
#include "tests/accuracy/oscillation.h"

namespace sunder {
namespace {

using namespace test;

TEST(rigid_motion, a_turned_and_moved_body_is_at_rest) {
    for (const double poisson_ratio : {0.0, 0.45}) {
        const Scene scene = lattice_scene({{3, 3, 6}, 0.1, 26, 1000, {}});
        Material material;
        material.poisson_ratio = poisson_ratio;
        const auto solver = make_solver(scene);
        FrameState state = solver->initial_state({material});
        const Quat turn(Eigen::AngleAxisd(2.5, Vec3(1, -2, 3).normalized()));
        const Vec3 shift(3, -4, 5);
        for (size_t i = 0; i < state.n_particles(); ++i) {
            state.position[i] = turn * scene.rest.rest_position[i] + shift;
            state.orientation[i] = turn * scene.rest.rest_orientation[i];
        }
        for (int f = 0; f < 24; ++f) advance(*solver, quiet_input(scene, material), {}, state);
        for (size_t i = 0; i < state.n_particles(); ++i) {
            EXPECT_LE((state.position[i] - turn * scene.rest.rest_position[i] - shift).norm(), 1e-11);
            EXPECT_LE(state.strain[i], 1e-11);
        }
    }
}

TEST(rigid_motion, a_spinning_bar_keeps_its_speed_and_shape) {
    const Scene scene = lattice_scene({{3, 3, 15}, 0.2 / 3, 6, 1000, {}});
    Material material;
    material.youngs_modulus = 2e8;  // centrifugal strain 3e-5
    const auto solver = make_solver(scene);
    FrameState state = solver->initial_state({material});
    const Vec3 spin(2 * M_PI, 0, 0), center(0, 0, 0.5);  // a turn a second
    for (size_t i = 0; i < state.n_particles(); ++i) {
        state.velocity[i] = spin.cross(scene.rest.rest_position[i] - center);
        state.angular_velocity[i] = spin;
    }
    SolverSettings settings;
    settings.self_collision = false;
    for (int f = 0; f < 24; ++f) advance(*solver, quiet_input(scene, material), settings, state);
    const Vec3 axis = state.position.back() - state.position.front(),
               rest_axis = scene.rest.rest_position.back() - scene.rest.rest_position.front();
    const double angle = std::atan2(rest_axis.cross(axis).x(), rest_axis.dot(axis)) / kDegree;
    std::printf("a full turn ends %.3f degrees off; length %.2e longer\n", angle, axis.norm() / rest_axis.norm() - 1);
    // A substep goes along the tangent, not the circle: second order in w h = 2 pi / 192.
    EXPECT_NEAR(angle, 0, 360 * std::pow(2 * M_PI / 192, 2));
    EXPECT_NEAR(axis.norm(), rest_axis.norm(), 1e-4 * rest_axis.norm());
}

// Pairs of substeps are of second order: exact. A substep alone is symplectic Euler's.
TEST(free_fall, follows_the_parabola) {
    const Scene scene = lattice_scene({{3, 3, 3}, 0.1, 26, 1000, Pose{Vec3(0, 0, 10), Quat::Identity()}});
    const Material material;
    const auto solver = make_solver(scene);
    FrameInput input = quiet_input(scene, material);
    input.gravity = Vec3(0, 0, -9.81);
    for (const int substeps : {1, 8}) {
        FrameState state = solver->initial_state({material});
        SolverSettings settings;
        settings.substeps = substeps;
        for (int f = 0; f < 24; ++f) advance(*solver, input, settings, state);
        const double late = substeps == 1 ? 9.81 / 24 / 2 : 0;
        for (size_t i = 0; i < state.n_particles(); ++i) {
            const double fall = scene.rest.rest_position[i].z() - state.position[i].z();
            EXPECT_NEAR(fall, 9.81 / 2 + late, 1e-10);
            EXPECT_NEAR(state.velocity[i].z(), -9.81, 1e-9);
        }
    }
}

// Strains in the middle of a bar that is drawn by `percent`: along it, and across it.
struct MiddleStrain {
    double along = 0, across = 0;
};
MiddleStrain middle_strain(const Bar& bar) {
    const SimulationMesh& rest = bar.scene.rest;
    double along = 0, along_rest = 0, across = 0, across_rest = 0;
    for (size_t i = 0; i < rest.n_particles(); ++i) {
        const Vec3 X = rest.rest_position[i] - Vec3(0, 0, 0.5), x = bar.state.position[i] - bar.state.position[0];
        if (std::abs(X.z()) > 0.11) continue;  // one width of the bar
        along += X.z() * x.z(), along_rest += X.z() * X.z();
        across += X.x() * x.x() + X.y() * x.y(), across_rest += X.x() * X.x() + X.y() * X.y();
    }
    return {along / along_rest - 1, across / across_rest - 1};
}

LoadedBar drawn_bar(int n, int neighbours, double poisson_ratio) {
    BarSetup setup;
    setup.load = Load::stretch, setup.n = n, setup.neighbours = neighbours, setup.poisson_ratio = poisson_ratio;
    LoadedBar bar(setup);
    bar.drive(1, 0.1);  // percent: small enough for linear elasticity
    EXPECT_GE(bar.settle(1e-6), 0);
    return bar;
}

TEST(uniaxial_stretch, contracts_sideways_by_poissons_ratio) {
    for (const int neighbours : {6, 26})
        for (const double nu : {0.0, 0.2, 0.3, 0.45}) {
            const LoadedBar bar = drawn_bar(6, neighbours, nu);
            const MiddleStrain e = middle_strain(bar.bar());
            std::printf("nu %.2f, %d neighbours: contracts by %.3f of its stretch\n", nu, neighbours,
                        -e.across / e.along);
            EXPECT_NEAR(-e.across / e.along, nu, 0.003);
        }
}

TEST(uniaxial_stretch, takes_the_force_of_youngs_modulus) {
    for (const int neighbours : {6, 26}) {
        for (const int n : {4, 8}) {
            const LoadedBar bar = drawn_bar(n, neighbours, 0);
            const double ratio = bar.reaction() / (2 * kShearModulus * 0.04 * middle_strain(bar.bar()).along);
            std::printf("%d neighbours, n = %d: force %.6f of Hooke's\n", neighbours, n, ratio);
            EXPECT_NEAR(ratio, 1, 1e-3);  // exact for a homogeneous stretch; the bar is let settle to 1e-6
        }
    }
}

// Under its own weight, by as much as its stiffness is less. Newton steps began from where gravity would take it, among
// those that are pinned far out of shape, so that they ended before they came to bending: one of 5 GPa fell by a
// millimetre a substep until it was felt, and sprang back.
TEST(cantilever, hangs_still_and_sags_by_one_over_its_stiffness) {
    for (const auto& [substeps, iterations] : {std::pair(1, 2), std::pair(4, 2), std::pair(4, 1), std::pair(16, 1)})
        for (const double youngs_modulus : {5e7, 5e8, 5e9, 5e10}) {
            Scene scene = test::lattice_scene({{12, 4, 2}, 0.1});
            test::add_pin(scene, [](const Vec3& x) { return x.x() < -0.45; });
            Material material;
            material.youngs_modulus = youngs_modulus, material.damping_time = 0.02;
            SolverSettings settings;
            settings.substeps = substeps, settings.iterations = iterations;
            FrameInput input = test::quiet_input(scene, material);
            input.gravity = Vec3(0, 0, -9.81);
            const auto solver = test::make_solver(scene);
            FrameState state = solver->initial_state({material});
            double low = 1, high = -1;
            for (int frame = 0; frame < 96; ++frame) {
                test::advance(*solver, input, settings, state);
                double sag = 0;  // of the end, m
                for (size_t i = 0; i < state.n_particles(); ++i)
                    if (const Vec3& x = scene.rest.rest_position[i]; x.x() > 0.5)
                        sag += (x.z() - state.position[i].z()) / 8;
                if (frame >= 48) low = std::min(low, sag), high = std::max(high, sag);
            }
            const std::string which = std::to_string(substeps) + " x " + std::to_string(iterations) + ", " +
                                      std::to_string(youngs_modulus) + " Pa";
            EXPECT_LE(high - low, 1e-5) << which;
            // What the softest does; a lattice two fragments thick is stiffer than a beam (0.0101).
            EXPECT_NEAR(high * youngs_modulus / 5e7, 0.0059, 0.0002) << which;
        }
}

TEST(vibration, half_periods_approach_theory) {
    for (const Mode mode : {Mode::axial, Mode::torsion, Mode::bending}) {
        Oscillation setup;
        setup.mode = mode, setup.n = 6, setup.substeps = 32, setup.iterations = 1;
        const double fine = half_period(setup), theory = half_period_in_theory(mode, setup.youngs_modulus);
        std::printf("half period %.4f s, theory %.4f s: %.1f %% off\n", fine, theory, 100 * (fine / theory - 1));
        EXPECT_NEAR(fine, theory, 0.04 * theory);
    }
}

// The same material at any number of particles, at the default substeps and iterations (row 11 of the study).
TEST(vibration, half_periods_at_the_defaults_are_those_of_fine_steps_from_40_to_1080_particles) {
    for (const Mode mode : {Mode::axial, Mode::torsion, Mode::bending})
        for (const int n : {2, 6}) {
            Oscillation setup;
            setup.mode = mode, setup.n = n;
            const SolverSettings defaults;
            setup.substeps = defaults.substeps, setup.iterations = defaults.iterations;
            const double coarse = half_period(setup);
            setup.substeps = 64, setup.iterations = 1;
            const double limit = half_period(setup);
            std::printf("n = %d: half period %.4f s, in the limit of fine steps %.4f s\n", n, coarse, limit);
            EXPECT_NEAR(coarse, limit, 0.05 * limit);
        }
}

}  // namespace
}  // namespace sunder
