// Where plasticity makes the paper's plain method run away (rows 2-4 of the numerical study).
#include <gtest/gtest.h>

#include "tests/stability/bars.h"

namespace sunder {
namespace {

using test::Bar;
using test::kDegree;
using test::PlainSettings;

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

    Bar plain(4, 26);  // with 6 neighbours it stays bounded (62 degrees)
    plain.plain = PlainSettings{.substeps = 3, .flow_per_step = 1};
    plain.material.yield = 0.05;
    plain.start();
    plain.turn(0, 360 * kDegree, 2);
    plain.hold(360 * kDegree, 0.5);
    plain.settings.damping = 2;
    plain.let_go(4);
    std::printf("plain method: residual twist %.1f degrees, plastic ratio %.1e%s\n", plain.twist() / kDegree,
                plain.plastic_ratio(), plain.sound ? "" : ", lost");
    EXPECT_TRUE(!plain.sound || plain.plastic_ratio() > 8);
}

// The head turned to and fro by 180 degrees at a frame's step of 15, ten times; the largest speed on the way, m/s.
constexpr double kCycleStep = 15 * kDegree;
double fastest_of_ten_cycles(Bar& bar) {
    bar.material.yield = 0.03;
    bar.start();
    double fastest = 0, angle = 0;
    for (int cycle = 0; cycle < 10; ++cycle)
        for (int k = 0; k < 48; ++k) {
            const double next = angle + ((k < 12 || k >= 36) ? kCycleStep : -kCycleStep);
            bar.turn(angle, next, 1.0 / 24);
            angle = next;
            fastest = std::max(fastest, bar.fastest());
        }
    return fastest;
}

TEST(cyclic_twist, ten_cycles_pump_nothing) {
    Bar bar;
    bar.material.flow_rate = 1.2;
    const double fastest = fastest_of_ten_cycles(bar);
    const double driven = 0.075 * std::sqrt(2.0) * kCycleStep * 24;  // the outermost driven particles
    std::printf("fastest %.2f m/s, driven %.2f m/s, plastic ratio %.2f\n", fastest, driven, bar.plastic_ratio());
    EXPECT_LE(fastest, 2 * driven);
    EXPECT_LE(bar.plastic_ratio(), 8.0);

    Bar plain(4, 26);
    plain.plain = PlainSettings{.substeps = 3};
    const double plain_fastest = fastest_of_ten_cycles(plain);
    std::printf("plain method: fastest %.2f m/s, plastic ratio %.1e%s\n", plain_fastest, plain.plastic_ratio(),
                plain.sound ? "" : ", lost");
    EXPECT_TRUE(!plain.sound || plain_fastest > 2 * driven || plain.plastic_ratio() > 8);
}

// A free bar with a plastic stretch of 2 along its axis, stress-free, left alone for 20 s; the largest ratio of its
// length to that at rest afterwards is 2 if nothing flows back.
double length_ratio_after_20_s(Bar& bar) {
    bar.scene.pins.clear();
    bar.material.yield = 0.02;
    bar.material.flow_rate = 30;
    bar.start();
    const Mat3 F = Vec3(std::sqrt(0.5), std::sqrt(0.5), 2).asDiagonal();
    for (size_t i = 0; i < bar.state.n_particles(); ++i) {
        bar.state.plastic_deformation[i] = F;
        bar.state.position[i] = F * bar.scene.rest.rest_position[i];
    }
    bar.let_go(20);
    double lowest = 1e9, highest = -1e9;
    for (const Vec3& x : bar.state.position) lowest = std::min(lowest, x.z()), highest = std::max(highest, x.z());
    return (highest - lowest) / 0.95;  // 19 spacings of 0.05 m
}

TEST(plastic_memory, a_drawn_bar_stays_drawn) {
    Bar bar;
    EXPECT_NEAR(length_ratio_after_20_s(bar), 2, 1e-6);
    for (double strain : bar.state.strain) EXPECT_LE(strain, 1e-9);

    Bar plain;
    plain.plain = PlainSettings{.substeps = 3, .flow_per_step = 0.02};
    const double ratio = length_ratio_after_20_s(plain);
    std::printf("plain method: length ratio %.3f after 20 s%s\n", ratio, plain.sound ? "" : ", lost");
    EXPECT_LT(ratio, 1.9);
}

}  // namespace
}  // namespace sunder
