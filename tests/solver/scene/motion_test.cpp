#include "solver/scene/motion.h"

#include <gtest/gtest.h>

namespace sunder {
namespace {

Pose turned_about(const Vec3& pivot, double angle, const Vec3& shift) {
    const Quat q(Eigen::AngleAxisd(angle, Vec3(1, 2, -1).normalized()));
    return {pivot + shift - q * pivot, q};
}

TEST(driven_pose, a_turn_about_a_far_pivot_goes_round_it_and_not_along_the_chord) {
    const Vec3 pivot(3, -2, 5), held(3.4, -2.3, 5.1);
    const DrivenPose drive{turned_about(pivot, 0, Vec3::Zero()), turned_about(pivot, 0.7, Vec3::Zero()), true, pivot};
    for (const double share : {0.0, 0.3, 0.5, 1.0}) {
        const Pose pose = interpolate(drive, share), wanted = turned_about(pivot, 0.7 * share, Vec3::Zero());
        EXPECT_LE((pose.apply(pivot) - pivot).norm(), 1e-14);
        EXPECT_LE((pose.apply(held) - wanted.apply(held)).norm(), 1e-14);
    }
}

TEST(driven_pose, a_pivot_that_moves_goes_straight) {
    const Vec3 pivot(3, -2, 5), shift(0.2, 0.1, -0.4);
    const DrivenPose drive{turned_about(pivot, 0.2, Vec3::Zero()), turned_about(pivot, 0.9, shift), true, pivot};
    const Pose pose = interpolate(drive, 0.25), wanted = turned_about(pivot, 0.375, 0.25 * shift);
    EXPECT_LE((pose.apply(pivot) - pivot - 0.25 * shift).norm(), 1e-14);
    EXPECT_LE(pose.orientation.angularDistance(wanted.orientation), 1e-14);
}

// The rotation by |w| about w, on both sides of where series take over.
TEST(rotation_of, is_the_exponential_to_a_rounding) {
    for (double angle = 1e-9; angle < 3; angle *= 1.07) {
        const Vec3 axis = Vec3(0.36, 0.48, -0.8);
        const Quat q = rotation_of(angle * axis);
        EXPECT_NEAR(q.w(), std::cos(angle / 2), 3e-16) << angle;
        EXPECT_LE((q.vec() - std::sin(angle / 2) * axis).norm(), 3e-16 * std::max(angle, 0.1)) << angle;
        EXPECT_NEAR(q.norm(), 1, 4e-16) << angle;
    }
    EXPECT_EQ(rotation_of(Vec3::Zero()).coeffs(), Quat::Identity().coeffs());
}

}  // namespace
}  // namespace sunder
