// Order, steps, inversion and thin bodies (rows 1, 8, 9, 11).
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/stability/bars.h"
#include "tests/stability/reversed.h"
#include "tests/support/energy.h"

namespace sunder {
namespace {

using test::Bar;
using test::kDegree;
using test::PlainSettings;

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
    EXPECT_LE(std::sqrt(asymmetry / displacement), 1e-6);  // no order of groups shows

    // Numbered from the other end it is the same bar (Gauss-Seidel in either order: see below).
    Bar backward;
    backward.scene = test::reversed(backward.scene);
    backward.settings.damping = 3;
    backward.start();
    backward.turn(0, 360 * kDegree, 2);
    backward.hold(360 * kDegree, 8);
    double by_order = 0;
    for (size_t i = 0; i < settled.size(); ++i)
        by_order += (backward.state.position[settled.size() - 1 - i] - bar.state.position[i]).squaredNorm();
    EXPECT_LE(std::sqrt(by_order / displacement), 1e-6);

    // The plain method's answer depends on the order of the groups.
    std::vector<Vec3> answer[2];
    for (const bool reverse : {false, true}) {
        Bar plain;
        plain.plain = PlainSettings{.substeps = 3, .backward = reverse};
        plain.settings.damping = 3;
        plain.start();
        plain.turn(0, 360 * kDegree, 2);
        plain.hold(360 * kDegree, 4);
        answer[reverse] = plain.state.position;
    }
    double wrong = 0, between = 0;
    for (size_t i = 0; i < settled.size(); ++i) {
        wrong += (answer[0][i] - bar.state.position[i]).squaredNorm();
        between += (answer[0][i] - answer[1][i]).squaredNorm();
    }
    std::printf("plain method: off by %.3f of the displacement; %.3f between sweep orders\n",
                std::sqrt(wrong / displacement), std::sqrt(between / displacement));
    EXPECT_FALSE(wrong <= 1e-4 * displacement && between <= 1e-4 * displacement);
}

// Half period of the bar when its head, turned by 60 degrees, is let go: twice the time to the first crossing of zero,
// s; negative when there is none within a second.
double half_period(Bar& bar, int steps_a_second) {
    bar.material.youngs_modulus = 6e5;
    bar.start();
    bar.settings.damping = 5;
    bar.turn(0, 60 * kDegree, 1);
    bar.hold(60 * kDegree, 3);
    bar.settings.damping = 0;
    bar.settings.substeps = 2;  // a pair
    if (bar.plain) bar.plain->substeps = 2;
    double last = bar.twist();
    const double h = 2.0 / steps_a_second, start = bar.state.time;
    for (int f = 0; f < steps_a_second / 2; ++f) {
        bar.frame(h, {}, {}, false);
        const double now = bar.twist();
        if (now <= 0) return 2 * (bar.state.time - start - h * (0 - now) / (last - now));
        last = now;
    }
    return -1;
}

TEST(stiffness, the_half_period_of_a_released_twist_is_that_of_the_material) {
    Bar fine(4, 6), usual(4, 6);
    fine.settings.substeps = 160;
    const double limit = half_period(fine, 24 * 160), at_defaults = half_period(usual, 24 * 8);
    std::printf("half period: %.4f s in the limit, %.4f s at the defaults\n", limit, at_defaults);
    EXPECT_NEAR(at_defaults, limit, 0.05 * limit);

    std::vector<double> plain_periods;
    for (const int steps : {60, 240, 960}) {
        Bar plain(4, 6);
        plain.plain = PlainSettings{.substeps = std::max(1, steps / 24), .correct_momentum = false};
        plain_periods.push_back(half_period(plain, steps));
        std::printf("plain method, %d steps a second: %.4f s\n", steps, plain_periods.back());
    }
    EXPECT_GT(plain_periods[0], 2 * plain_periods[2]);  // its stiffness is the step's, not the material's
}

enum class Crush { flattened, point, random };

// Brings the free bar's particles out of any order.
void crush(Bar& bar, Crush kind) {
    std::mt19937_64 rng(11);
    std::uniform_real_distribution<double> uniform(-1, 1);
    bar.scene.pins.clear();
    bar.settings.damping = 4;
    bar.settings.self_collision = false;  // the recovery alone
    bar.start();
    for (Vec3& x : bar.state.position) {
        if (kind == Crush::flattened) x.z() *= 1e-6;
        if (kind == Crush::point) x *= 1e-6;
        if (kind == Crush::random) x = 0.3 * Vec3(uniform(rng), uniform(rng), uniform(rng));
    }
}

bool finite(const FrameState& state) {
    for (size_t i = 0; i < state.n_particles(); ++i)
        if (!state.position[i].allFinite() || !state.plastic_deformation[i].allFinite()) return false;
    return true;
}

TEST(inversion, any_crushed_start_comes_back) {
    for (const Crush kind : {Crush::flattened, Crush::point, Crush::random}) {
        Bar bar(3, 26);
        crush(bar, kind);
        bar.let_go(10);
        ASSERT_TRUE(finite(bar.state));
        const double strain = *std::ranges::max_element(bar.state.strain);
        std::printf("start %d: largest strain left %.2e\n", int(kind), strain);
        EXPECT_LE(strain, 1e-3);
    }
}

TEST(inversion, a_crushed_start_stays_finite_when_the_material_flows) {
    for (const Crush kind : {Crush::flattened, Crush::point, Crush::random}) {
        Bar bar(3, 26), plain(3, 26);
        bar.material.yield = plain.material.yield = 0.05;
        plain.plain = PlainSettings{.substeps = 3};
        for (Bar* b : {&bar, &plain}) {
            crush(*b, kind);
            b->let_go(2);
        }
        EXPECT_TRUE(finite(bar.state));
        EXPECT_LE(bar.plastic_ratio(), 8 * (1 + 1e-9));
        std::printf("start %d: plastic ratio %.2f; plain method %.1e%s\n", int(kind), bar.plastic_ratio(),
                    plain.plastic_ratio(), plain.sound ? "" : ", lost");
    }
}

// What a group turns its fragments by has to be the gradient of what its own rotation minimises, or it turns itself.
// With the angle for the torque two stiff fragments that stood askew to their bar reached 1e5 m/s.
TEST(inversion, two_stiff_fragments_askew_to_their_bar_gain_nothing) {
    // The most that there was of the start's energy.
    const auto highest = [](double degrees, bool flowed, Method method, int substeps) {
        Scene scene;
        SimulationMesh mesh = test::lattice_mesh({{2, 1, 1}, 0.1, 6, 1000, {}});
        for (Vec3& r : mesh.radii) r = Vec3(0.05, 0.04, 0.03);
        test::add_body(scene, mesh);
        Material material;
        material.youngs_modulus = 1e8, material.poisson_ratio = flowed ? 0.45 : 0;
        const auto solver = test::make_solver(scene);
        FrameState state = solver->initial_state({material});
        const Quat askew(Eigen::AngleAxisd(degrees * kDegree, Vec3(0.1, 1, 0.3).normalized()));
        for (Quat& q : state.orientation) q = askew * q;
        if (flowed)
            for (Mat3& F_P : state.plastic_deformation) F_P.diagonal() = Vec3(0.5, 4, 0.5);
        SolverSettings settings;
        settings.method = method, settings.substeps = substeps;
        const auto energy = [&] { return test::energy(solver->scene(), material, Vec3::Zero(), state).total(); };
        const double start = energy();
        double most = 0;
        for (int f = 0; f < 48; ++f) {
            test::advance(*solver, test::quiet_input(scene, material), settings, state);
            most = std::max(most, energy() / start);
        }
        return most;
    };
    for (const Method method : {Method::projective, Method::jacobi, Method::gauss_seidel}) {
        double most = 0;
        for (const bool flowed : {false, true})
            for (const double degrees : {30.0, 60.0, 120.0, 170.0})
                for (const int substeps : {1, 2, 8}) {
                    const double here = highest(degrees, flowed, method, substeps);
                    EXPECT_LE(here, 1) << degrees << " degrees, " << substeps << " substeps"
                                       << (flowed ? ", flowed" : "");
                    most = std::max(most, here);
                }
        std::printf("method %d, askew: %.2g of the energy at most\n", int(method), most);
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

}  // namespace
}  // namespace sunder
