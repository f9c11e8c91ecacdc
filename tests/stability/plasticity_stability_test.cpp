// Where plasticity makes the paper's plain method run away (rows 2-4 of the numerical study).
#include <gtest/gtest.h>

#include "tests/stability/bars.h"

namespace sunder {
namespace {

using test::Bar;
using test::kDegree;

TEST(plastic_runaway, a_full_turn_leaves_a_residual_that_no_step_size_changes) {
    double least = 1e9, most = -1e9;
    for (int substeps : {3, 5, 10}) {  // 72, 120, 240 a second
        Bar bar;
        bar.material.yield = 0.05;
        bar.material.flow_rate = 1.2;
        bar.settings.substeps = substeps;
        bar.start();
        bar.turn(0, 360 * kDegree, 2);
        bar.hold(360 * kDegree, 0.5);
        bar.settings.damping = 2;
        bar.let_go(4);
        const double residual = bar.twist() / kDegree;
        EXPECT_LE(bar.plastic_ratio(), 8.0);
        EXPECT_GE(residual, 0);
        EXPECT_LE(residual, 360);
        least = std::min(least, residual), most = std::max(most, residual);
    }
    std::printf("residual twist %.1f to %.1f degrees\n", least, most);
    EXPECT_LE(most - least, 10);  // +-5
}

TEST(cyclic_twist, ten_cycles_pump_nothing) {
    Bar bar;
    bar.material.yield = 0.03;
    bar.material.flow_rate = 1.2;
    bar.start();
    double fastest = 0;
    const double step = 15 * kDegree;  // a twelfth of a half turn, in 1/12 s: 180 degrees a second
    double angle = 0;
    for (int cycle = 0; cycle < 10; ++cycle)
        for (int k = 0; k < 48; ++k) {
            const double next = angle + ((k < 12 || k >= 36) ? step : -step);
            bar.turn(angle, next, 1.0 / 24);
            angle = next;
            fastest = std::max(fastest, bar.fastest());
        }
    const double driven = 0.075 * std::sqrt(2.0) * step * 24;  // the outermost driven particles
    std::printf("fastest %.2f m/s, driven %.2f m/s, plastic ratio %.2f\n", fastest, driven, bar.plastic_ratio());
    EXPECT_LE(fastest, 2 * driven);
    EXPECT_LE(bar.plastic_ratio(), 8.0);
}

TEST(plastic_memory, a_drawn_bar_stays_drawn) {
    Bar bar;
    bar.scene.pins.clear();
    bar.material.yield = 0.02;
    bar.material.flow_rate = 30;
    bar.start();
    const Mat3 F = Vec3(std::sqrt(0.5), std::sqrt(0.5), 2).asDiagonal();
    for (size_t i = 0; i < bar.state.n_particles(); ++i) {
        bar.state.plastic_deformation[i] = F;
        bar.state.position[i] = F * bar.scene.rest.rest_position[i];
    }
    const std::vector<Vec3> start = bar.state.position;
    const FrameInput in = test::quiet_input(bar.scene, bar.material);
    for (int f = 0; f < 480; ++f) test::advance(*bar.solver, in, bar.settings, bar.state);
    double lowest = 1e9, highest = -1e9;
    for (const Vec3& x : bar.state.position) lowest = std::min(lowest, x.z()), highest = std::max(highest, x.z());
    EXPECT_NEAR((highest - lowest) / (0.95), 2, 1e-6);  // 19 spacings of 0.05 m
    for (double strain : bar.state.strain) EXPECT_LE(strain, 1e-9);
}

}  // namespace
}  // namespace sunder
