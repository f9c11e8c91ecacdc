#include "solver/data/rotations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace sunder {
namespace {

Quat random_rotation(std::mt19937_64& draws) {
    const auto share = [&] { return static_cast<double>(draws() >> 11) * 0x1p-52 - 1; };
    Eigen::Vector4d q;
    for (double& component : q) component = share();
    return Quat(q.normalized());
}

// Rounding of unit quaternions, and of an angle from the sine of its half.
constexpr double kRounding = 1e-15, kRoundingOfAngle = 4e-15;

TEST(rotations, about_an_axis_turns_by_the_angle) {
    const Vec3 axis = Vec3(1, -2, 0.5).normalized(), across = axis.unitOrthogonal();
    for (const double angle : {-3.0, -0.1, 0.0, 1e-9, 0.7, 2.0, 3.1}) {
        const Quat turn = rotation_about(axis, angle);
        EXPECT_LT((turn * axis - axis).norm(), kRounding);
        const Vec3 turned = std::cos(angle) * across + std::sin(angle) * axis.cross(across);
        EXPECT_LT((turn * across - turned).norm(), kRounding);
        EXPECT_NEAR(angle_between(turn, Quat::Identity()), std::abs(angle), kRoundingOfAngle);
    }
}

TEST(rotations, slerp_turns_steadily_and_the_shorter_way_round) {
    std::mt19937_64 draws(3);
    for (int i = 0; i < 1000; ++i) {
        const Quat from = random_rotation(draws), to = random_rotation(draws);
        const double whole = angle_between(from, to);
        EXPECT_LE(whole, std::numbers::pi);
        for (const double share : {0.125, 0.5, 0.9}) {
            const Quat now = slerp(from, share, to);
            EXPECT_NEAR(now.norm(), 1, 4 * kRounding);
            EXPECT_NEAR(angle_between(from, now), share * whole, kRoundingOfAngle);
            EXPECT_NEAR(angle_between(now, to), (1 - share) * whole, kRoundingOfAngle);
        }
    }
}

TEST(rotations, slerp_ends_where_it_is_told_to) {
    std::mt19937_64 draws(4);
    for (int i = 0; i < 1000; ++i) {
        const Quat from = random_rotation(draws), to = random_rotation(draws);
        EXPECT_EQ(slerp(from, 0, to).coeffs(), from.coeffs());
        EXPECT_LT(angle_between(slerp(from, 1, to), to), kRoundingOfAngle);
        EXPECT_EQ(slerp(from, 0, from).coeffs(), from.coeffs());
    }
}

TEST(rotations, slerp_of_what_hardly_differs_does_not_divide_by_nothing) {
    const Quat from = Quat::Identity();
    for (const double angle : {0.0, 1e-300, 1e-16, 1e-9, 3e-8, 1e-7}) {
        const Quat now = slerp(from, 0.25, rotation_about(Vec3::UnitX(), angle));
        EXPECT_NEAR(now.x(), 0.125 * angle, 1e-15 * angle);
        EXPECT_NEAR(now.w(), 1, kRounding);
    }
}

}  // namespace
}  // namespace sunder
