// Errors fall as particles, substeps and iterations are added, at the orders that the method should have.
#include <cmath>

#include "tests/accuracy/bar_cases.h"
#include "tests/accuracy/oscillation.h"

namespace sunder {
namespace {

using namespace test;

// What is left at four across has no order to speak of: errors of opposite sign meet (few particles, and clamps that
// groups straddle). The fields' order is printed by Fields.
TEST(convergence, half_periods_in_particles) {
    for (const Mode mode : {Mode::axial, Mode::torsion, Mode::bending}) {
        double error = 0;
        for (const int n : {2, 4}) {
            Oscillation setup;
            setup.mode = mode, setup.n = n, setup.substeps = 32, setup.iterations = 1;
            error = half_period(setup) / half_period_in_theory(mode, setup.youngs_modulus) - 1;
            std::printf("half period: %+.1f %% off at n = %d\n", 100 * error, n);
        }
        EXPECT_LE(std::abs(error), 0.05);
    }
}

TEST(convergence, half_periods_in_substeps) {
    std::vector<double> periods;
    Oscillation setup;
    setup.youngs_modulus = 2e6;
    for (const int substeps : {8, 16, 512}) {
        setup.substeps = substeps;
        periods.push_back(half_period(setup));
    }
    const double coarse = periods[0] / periods[2] - 1, fine = periods[1] / periods[2] - 1;
    std::printf("half period: %.2f, %.2f %% off at 8, 16 substeps; order %.2f\n", 100 * coarse, 100 * fine,
                std::log2(coarse / fine));
    EXPECT_GE(std::log2(coarse / fine), 1.5);  // implicit Euler: damping of first order, period of second
}

TEST(convergence, a_step_in_iterations) {
    // One substep of a twisted bar whose head was just let go, against the same step with many iterations.
    BarSetup setup;
    LoadedBar held(setup);
    held.drive(90, 0.5);
    held.settle();
    const auto step = [&](int iterations) {
        const Bar& bar = held.bar();
        FrameState state = bar.state;
        FrameInput in = quiet_input(bar.scene, bar.material, 1.0 / 192);
        in.pins[1].active = false;
        SolverSettings settings;
        settings.self_collision = false, settings.substeps = 1, settings.iterations = iterations;
        advance(*bar.solver, in, settings, state);
        return state.position;
    };
    const std::vector<Vec3> exact = step(64);
    std::vector<double> error;
    for (const int iterations : {1, 2, 4, 8}) {
        const std::vector<Vec3> x = step(iterations);
        double sum = 0, moved = 0;
        for (size_t i = 0; i < x.size(); ++i)
            sum += (x[i] - exact[i]).squaredNorm(), moved += (exact[i] - held.bar().state.position[i]).squaredNorm();
        error.push_back(std::sqrt(sum / moved));
    }
    std::printf("error of one step with 1, 2, 4, 8 iterations: %.1e, %.1e, %.1e, %.1e\n", error[0], error[1], error[2],
                error[3]);
    EXPECT_LE(error[1], 0.5 * error[0]);
    EXPECT_LE(error[2], 0.25 * error[1]);
    EXPECT_LE(error[3], 0.0625 * error[2]);
}

}  // namespace
}  // namespace sunder
