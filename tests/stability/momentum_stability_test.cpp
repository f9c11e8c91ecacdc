// Angular momentum and energy of a tumbling, vibrating bar over thousands of steps (rows 5 and 6).
#include <gtest/gtest.h>

#include "tests/stability/bars.h"

namespace sunder {
namespace {

using test::Bar;
using test::PlainSettings;

struct Motion {
    Vec3 angular = Vec3::Zero();  // about the centre of mass, kg m2/s
    double kinetic = 0;           // J
};

Motion motion_of(const SimulationMesh& rest, const FrameState& s) {
    Motion m;
    Vec3 center = Vec3::Zero(), velocity = Vec3::Zero();
    double mass = 0;
    for (size_t i = 0; i < s.n_particles(); ++i)
        mass += rest.mass[i], center += rest.mass[i] * s.position[i], velocity += rest.mass[i] * s.velocity[i];
    center /= mass, velocity /= mass;
    for (size_t i = 0; i < s.n_particles(); ++i) {
        const Mat3 R = s.orientation[i].toRotationMatrix();
        const Vec3 a = rest.mass[i] / 5 * rest.radii[i].cwiseProduct(rest.radii[i]);
        const Vec3 Hw = R * (a.sum() * Vec3::Ones() - a).cwiseProduct(R.transpose() * s.angular_velocity[i]);
        m.angular += rest.mass[i] * (s.position[i] - center).cross(s.velocity[i] - velocity) + Hw;
        m.kinetic += 0.5 * (rest.mass[i] * (s.velocity[i] - velocity).squaredNorm() + s.angular_velocity[i].dot(Hw));
    }
    return m;
}

struct Drift {
    double angular = 0;       // |L - L0| / |L0|
    double later_energy = 0;  // largest kinetic energy after the first second over the largest in it
};

// A free bar turning once a second, stretched by a tenth.
Drift tumble(Bar& bar, double h, int steps, int substeps = 1) {
    bar.scene.pins.clear();
    bar.settings.substeps = substeps, bar.settings.iterations = 1;
    bar.settings.self_collision = false;
    bar.start();
    const SimulationMesh& rest = bar.scene.rest;
    const Vec3 center(0, 0, 0.5), spin(2 * M_PI, 0.3, 0);
    for (size_t i = 0; i < bar.state.n_particles(); ++i) {
        const Vec3 r = rest.rest_position[i] - center;
        bar.state.position[i] = center + 1.1 * r;
        bar.state.velocity[i] = spin.cross(r);
        bar.state.angular_velocity[i] = spin;
    }
    const Motion start = motion_of(rest, bar.state);
    Drift drift;
    double first_second = start.kinetic;
    for (int k = 0; k < steps && bar.sound; ++k) {
        bar.frame(h, {}, {});
        const Motion now = motion_of(rest, bar.state);
        drift.angular = (now.angular - start.angular).norm() / start.angular.norm();
        if (k * h < 1)
            first_second = std::max(first_second, now.kinetic);
        else
            drift.later_energy = std::max(drift.later_energy, now.kinetic / first_second);
    }
    return drift;
}

TEST(angular_momentum, is_kept_over_thousands_of_steps_of_any_length) {
    for (const int hz : {30, 60, 240}) {
        Bar bar(2), paired(2), plain(2), uncorrected(2);
        plain.plain = PlainSettings{.iterations = 2};
        uncorrected.plain = PlainSettings{.iterations = 2, .correct_momentum = false};
        const Drift ours = tumble(bar, 1.0 / hz, 3000), pairs = tumble(paired, 2.0 / hz, 1500, 2);
        const Drift printed = tumble(plain, 1.0 / hz, 3000), none = tumble(uncorrected, 1.0 / hz, 3000);
        std::printf(
            "%3d Hz: drift %.1e, later energy %.3f; in pairs %.1e, %.3f; plain method %.1e%s, without correction "
            "%.1e\n",
            hz, ours.angular, ours.later_energy, pairs.angular, pairs.later_energy, printed.angular,
            plain.sound ? "" : " and lost", none.angular);
        for (const Drift& drift : {ours, pairs}) {
            EXPECT_LE(drift.angular, 1e-7);
            EXPECT_LE(drift.later_energy, 1.03);
        }
        EXPECT_GT(none.angular, 1e-3);
        EXPECT_TRUE(!plain.sound || printed.angular > 1e-7);
    }
}

TEST(angular_momentum, is_kept_with_elongated_ellipsoids) {
    Bar bar(2), plain(2);
    for (Bar* b : {&bar, &plain})
        for (Vec3& r : b->scene.rest.radii) r = 0.05 * Vec3(0.5, 1, 1.6);
    plain.plain = PlainSettings{.iterations = 2};
    const Drift ours = tumble(bar, 1.0 / 240, 1000), printed = tumble(plain, 1.0 / 240, 1000);
    std::printf("drift %.1e; plain method %.1e\n", ours.angular, printed.angular);
    EXPECT_LE(ours.angular, 1e-9);
    EXPECT_GT(printed.angular, 1e-7);
}

}  // namespace
}  // namespace sunder
