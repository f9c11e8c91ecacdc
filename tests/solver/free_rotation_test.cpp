#include "solver/pieces/free_rotation.h"

#include <gtest/gtest.h>

#include "solver/scene/motion.h"

namespace sunder {
namespace {

const Quat kTilted = Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, -0.5).normalized()));

double turning_energy(const Vec3& L, const Turning& t) { return 0.5 * L.dot(t.angular_velocity); }

TEST(free_rotation, a_sphere_turns_steadily_however_far_in_one_step) {
    const Vec3 L(0.3, -0.2, 0.5);
    const Turning t = turn_freely(kTilted, Vec3::Constant(0.1), L, 2.0);  // 12 rad
    const Quat expected = Quat(Eigen::AngleAxisd(20 * L.norm(), L.normalized())) * kTilted;
    EXPECT_LE(t.frame.angularDistance(expected), 1e-12);
    EXPECT_LE((t.angular_velocity - 10 * L).norm(), 1e-12);
}

// Precession about L at |L|/I, spin about the axis at L_3 (1/I_3 - 1/I).
TEST(free_rotation, a_symmetric_top_precesses_as_in_closed_form) {
    for (double axial : {0.02, 0.5}) {
        const Vec3 moments(0.1, 0.1, axial), L(0.3, -0.2, 0.5);
        const double h = 0.7, along = L.dot(kTilted * Vec3::UnitZ());
        const Quat expected = Quat(Eigen::AngleAxisd(h * L.norm() / 0.1, L.normalized())) * kTilted *
                              Quat(Eigen::AngleAxisd(h * along * (1 / axial - 10), Vec3::UnitZ()));
        EXPECT_LE(turn_freely(kTilted, moments, L, h).frame.angularDistance(expected), 1e-10) << axial;
    }
}

TEST(free_rotation, many_small_steps_and_a_large_one_agree) {
    const Vec3 moments(0.1, 0.17, 0.23), L(0.3, -0.2, 0.5);
    Quat fine = kTilted;
    for (int k = 0; k < 10000; ++k) fine = turn_freely(fine, moments, L, 1e-4).frame;
    // Second order: inner steps of 0.25 rad are off by (0.25)^2 / 24 a radian, over 3 rad.
    EXPECT_LE(turn_freely(kTilted, moments, L, 1.0).frame.angularDistance(fine), 0.01);
}

// Taking the orientation of the last step's angular velocity lets a needle's energy go anywhere between L^2/2I_max and
// L^2/2I_min: here a factor of 250.
TEST(free_rotation, a_tumbling_needle_does_not_end_up_spinning_about_its_axis) {
    const Vec3 moments(1.0, 0.99, 0.004);
    Turning t{kTilted, {}};
    const Vec3 L = kTilted * Vec3(100, 1, 0.05);
    t.angular_velocity = t.frame * (t.frame.conjugate() * L).cwiseQuotient(moments);
    const double start = turning_energy(L, t);
    double highest = start;
    for (int k = 0; k < 10000; ++k) {
        t = turn_freely(t.frame, moments, L, 1.0 / 192);
        highest = std::max(highest, turning_energy(L, t));
    }
    std::printf("energy at most %.4f of the start\n", highest / start);
    EXPECT_LE(highest, 1.02 * start);
}

}  // namespace
}  // namespace sunder
