#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <random>

#include "solver/matching/polar_decomposition.h"
#include "tests/support/reference_stretch.h"

namespace sunder {
namespace {

using test::optimal_stretch;
using test::principal_stretch;
using test::stretch_basis;

struct PointSet {
    std::vector<Vec3> q, p;  // rest and present positions about their centres
    std::vector<double> m;

    Mat3 A_pq() const {
        Mat3 A = Mat3::Zero();
        for (size_t i = 0; i < q.size(); ++i) A += m[i] * p[i] * q[i].transpose();
        return A;
    }
    Mat3 A_qq() const {
        Mat3 A = Mat3::Zero();
        for (size_t i = 0; i < q.size(); ++i) A += m[i] * q[i] * q[i].transpose();
        return A;
    }
    // Eq. 2: what the optimal stretch makes least.
    double residual(const Mat3& R, const Mat3& S) const {
        double e = 0;
        for (size_t i = 0; i < q.size(); ++i) e += m[i] * (R * S * q[i] - p[i]).squaredNorm();
        return e;
    }
};

PointSet random_points(std::mt19937_64& rng, size_t n) {
    std::normal_distribution<double> normal;
    auto vec = [&] { return Vec3(normal(rng), normal(rng), normal(rng)); };
    PointSet s;
    const Mat3 F = Mat3::Identity() + 0.2 * (Mat3() << vec(), vec(), vec()).finished();
    for (size_t i = 0; i < n; ++i) {
        s.q.push_back(vec());
        s.p.push_back(F * s.q.back() + 0.05 * vec());
        s.m.push_back(0.5 + std::abs(normal(rng)));
    }
    return s;
}

TEST(optimal_stretch, no_symmetric_matrix_fits_better) {
    std::mt19937_64 rng(3);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 200; ++k) {
        const PointSet points = random_points(rng, 8);
        const Mat3 R = optimal_rotation_svd(points.A_pq()).toRotationMatrix();
        const Mat3 S = optimal_stretch(stretch_basis(points.A_qq()), R, points.A_pq());
        const double best = points.residual(R, S);
        for (int trial = 0; trial < 20; ++trial) {
            Mat3 change;
            for (int i = 0; i < 9; ++i) change(i / 3, i % 3) = 1e-3 * normal(rng);
            ASSERT_GT(points.residual(R, S + 0.5 * (change + change.transpose())), best);
        }
    }
}

TEST(optimal_stretch, reads_a_rotated_homogeneous_stretch_exactly_where_axes_agree) {
    const Vec3 lambda(0.8, 1.0, 1.4);
    PointSet points;
    for (int i = 0; i < 8; ++i) {
        const Vec3 q((i & 1) ? 1 : -1, (i & 2) ? 2 : -2, (i & 4) ? 0.5 : -0.5);
        points.q.push_back(q), points.m.push_back(1);
    }
    const Mat3 R = Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())).toRotationMatrix();
    for (const Vec3& q : points.q) points.p.push_back(R * lambda.asDiagonal() * q);
    const Mat3 found = optimal_rotation(points.A_pq(), Quat::Identity()).toRotationMatrix();
    EXPECT_LE((found - R).norm(), 1e-12);
    EXPECT_LE((optimal_stretch(stretch_basis(points.A_qq()), found, points.A_pq()) - Mat3(lambda.asDiagonal())).norm(),
              1e-12);
}

// The inset of section 3.1: a quad stretched purely (polar factor R_l = I) along an axis that is not its own. The
// optimal rotation is not I, and the stretch that fits it is not the polar stretch.
TEST(optimal_stretch, differs_from_the_polar_stretch_of_a_stretched_quad) {
    PointSet quad;
    const Mat3 turn = Quat(Eigen::AngleAxisd(M_PI / 4, Vec3::UnitZ())).toRotationMatrix();
    const Mat3 S_l = turn * Vec3(1.6, 1.0, 1.0).asDiagonal() * turn.transpose();
    for (const Vec3& q :
         {Vec3(2, 1, 0), Vec3(-2, 1, 0), Vec3(-2, -1, 0), Vec3(2, -1, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)}) {
        quad.q.push_back(q), quad.p.push_back(S_l * q), quad.m.push_back(1);
    }
    const Mat3 polar = optimal_rotation(quad.A_pq() * quad.A_qq().inverse(), Quat::Identity()).toRotationMatrix();
    EXPECT_LE((polar - Mat3::Identity()).norm(), 1e-12);

    const Quat R = optimal_rotation(quad.A_pq(), Quat::Identity());
    EXPECT_GT(R.angularDistance(Quat::Identity()), 0.05);  // about 8 degrees: the red quad of the inset
    const Mat3 S = optimal_stretch(stretch_basis(quad.A_qq()), R.toRotationMatrix(), quad.A_pq());
    EXPECT_GT((S - S_l).norm(), 0.05);
    EXPECT_LT(quad.residual(R.toRotationMatrix(), S), quad.residual(R.toRotationMatrix(), S_l));
}

TEST(optimal_stretch, stays_accurate_for_ill_conditioned_rest_shapes) {
    for (double cond : {1e2, 1e3}) {  // of F_P; A_qq has its square
        const Mat3 F_P = Vec3(std::sqrt(cond), 1, 1 / std::sqrt(cond)).asDiagonal();
        const Vec3 lambda(0.9, 1.05, 1.2);
        PointSet points;
        for (int i = 0; i < 8; ++i) {
            points.q.push_back(F_P * Vec3((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, (i & 4) ? 1 : -1));
            points.p.push_back(lambda.asDiagonal() * points.q.back()), points.m.push_back(1);
        }
        const Mat3 S = optimal_stretch(stretch_basis(points.A_qq()), Mat3::Identity(), points.A_pq());
        const Vec3 found = principal_stretch(S).log_strain;
        EXPECT_LE((found - Vec3(lambda.array().log())).cwiseAbs().maxCoeff(), 1e-6) << cond;
    }
}

TEST(optimal_stretch, of_flat_and_collapsed_groups_is_finite) {
    for (const Mat3& A : {Mat3(Vec3(1, 1, 0).asDiagonal()), Mat3(Vec3(1, 0, 0).asDiagonal()), Mat3(Mat3::Zero())})
        EXPECT_TRUE(optimal_stretch(stretch_basis(A), Mat3::Identity(), A).allFinite());
}

TEST(principal_stretch, marks_inverted_groups_and_clamps_their_logarithm) {
    const PrincipalStretch p = principal_stretch(Vec3(-0.3, 1.1, 20).asDiagonal());
    EXPECT_FALSE(p.reliable);
    EXPECT_DOUBLE_EQ(p.log_strain(0), std::log(0.1));
    EXPECT_DOUBLE_EQ(p.log_strain(2), std::log(10.0));
}

}  // namespace
}  // namespace sunder
