#include "solver/matching/polar_decomposition.h"

#include <gtest/gtest.h>

#include <random>

namespace sunder {
namespace {

Mat3 random_matrix(std::mt19937_64& rng) {
    std::normal_distribution<double> normal;
    Mat3 m;
    for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = normal(rng);
    return m;
}
Quat random_rotation(std::mt19937_64& rng) {
    std::normal_distribution<double> normal;
    return Quat(normal(rng), normal(rng), normal(rng), normal(rng)).normalized();
}

// The best rotation's score tr(R^T A) = s1 + s2 + sign(det A) s3 cannot be beaten: no other answer is as good.
double best_score(const Mat3& A) { return (optimal_rotation_svd(A).toRotationMatrix().transpose() * A).trace(); }

TEST(optimal_rotation, is_right_from_any_start_for_any_matrix) {
    std::mt19937_64 rng(1);
    for (int k = 0; k < 100000; ++k) {
        Mat3 A = random_matrix(rng);
        if (k % 3 == 1) {  // nearly flat
            const Quat U = random_rotation(rng), V = random_rotation(rng);
            A = U.toRotationMatrix() * Vec3(1, 0.7, 1e-6).asDiagonal() * V.toRotationMatrix();
        }
        if (k % 3 == 2 && A.determinant() > 0) A = -A;  // inverted
        const Quat start =
            Quat(Eigen::AngleAxisd(1.0472, random_rotation(rng) * Vec3::UnitX())) * optimal_rotation_svd(A);
        const Mat3 R = optimal_rotation(A, start).toRotationMatrix();
        const Mat3 B = R.transpose() * A;
        ASSERT_NEAR(R.determinant(), 1, 1e-12);
        ASSERT_LE((B - B.transpose()).norm(), 1e-10 * A.norm()) << k;
        // 1e-9: where two singular values nearly cancel, many rotations score alike.
        ASSERT_GE(B.trace(), best_score(A) - 1e-9 * A.norm()) << k;
    }
}

TEST(optimal_rotation, recovers_the_rotation_of_a_rigid_motion_to_rounding) {
    std::mt19937_64 rng(2);
    for (int k = 0; k < 1000; ++k) {
        const Quat R = random_rotation(rng);
        const Mat3 G = random_matrix(rng);
        const Mat3 A_qq = G * G.transpose() + 0.1 * Mat3::Identity();
        EXPECT_LE(optimal_rotation(R.toRotationMatrix() * A_qq, Quat::Identity()).angularDistance(R),
                  1e-7 * A_qq.norm());
    }
}

TEST(optimal_rotation, of_nothing_is_the_start) {
    const Quat start(Eigen::AngleAxisd(0.3, Vec3::UnitY()));
    EXPECT_EQ(optimal_rotation(Mat3::Zero(), start).coeffs(), start.coeffs());
}

}  // namespace
}  // namespace sunder
