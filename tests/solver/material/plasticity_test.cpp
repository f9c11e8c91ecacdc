#include "solver/material/plasticity.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>

#include "tests/support/flow.h"
#include "tests/support/reference_stretch.h"

namespace sunder {
namespace {

using sunder::flow;
using test::flow;
using test::principal_stretch;

Material ductile(double yield, double rate) {
    Material m;
    m.yield = yield;
    m.flow_rate = rate;
    return m;
}

PrincipalStretch stretch_of(const Vec3& log_strain) {
    return principal_stretch(Vec3(log_strain.array().exp()).asDiagonal());
}
double largest(const Vec3& v) { return v.cwiseAbs().maxCoeff(); }

// A group held at a total strain: the elastic part is what F_P has not taken.
double plastic_strain_after(double seconds, double h, const Material& material, double held) {
    PlasticState state{Mat3::Identity(), material.yield};
    const Vec3 total(held, -held / 2, -held / 2);
    const int steps = static_cast<int>(std::lround(seconds / h));
    for (int i = 0; i < steps; ++i)
        flow(stretch_of(total - Vec3(state.F_P.diagonal().array().log())), material, h, state);
    return std::log(state.F_P(0, 0));
}

TEST(plastic_flow, does_not_depend_on_the_step) {
    const Material m = ductile(0.05, 1.2);
    const double reference = plastic_strain_after(0.1, 1e-5, m, 0.2);
    EXPECT_NEAR(reference, 0.15 * -std::expm1(-0.12), 1e-6);  // closed form of the excess decaying at the flow rate
    for (double h : {1.0 / 30, 1.0 / 60, 1.0 / 240, 1e-3})
        EXPECT_NEAR(plastic_strain_after(0.1, 0.1 / std::round(0.1 / h), m, 0.2), reference, 0.01 * reference);
}

TEST(plastic_flow, never_passes_below_the_yield_surface) {
    const Material m = ductile(0.05, 1e5);
    EXPECT_LE(plastic_strain_after(1.0, 1.0 / 24, m, 0.2), 0.15 + 1e-12);
}

TEST(plastic_flow, pressure_alone_does_not_melt) {
    const Material m = ductile(0.1, 1e3);
    PlasticState state{Mat3::Identity(), m.yield};
    const FlowResult r = flow(stretch_of(Vec3(-0.12 + 0.05, -0.12, -0.12 - 0.05)), m, 0.1, state);
    EXPECT_FALSE(r.flowed);
    EXPECT_EQ(state.F_P, Mat3::Identity());
}

TEST(plastic_flow, takes_the_deviator_and_leaves_the_volume) {
    const Material m = ductile(0.01, 1e4);
    PlasticState state{Mat3::Identity(), m.yield};
    const FlowResult r = flow(stretch_of(Vec3(0.3, 0.0, -0.1)), m, 1.0, state);
    EXPECT_TRUE(r.flowed);
    EXPECT_NEAR(state.F_P.determinant(), 1, 1e-12);
    EXPECT_NEAR(r.elastic_log_strain.sum(), 0.2, 1e-12);
    EXPECT_NEAR(largest(r.elastic_log_strain.array() - r.elastic_log_strain.mean()), m.yield, 1e-9);
}

TEST(plastic_flow, stores_no_spin_in_a_closed_shear_loop) {
    const Material m = ductile(0.02, 50);
    PlasticState state{Mat3::Identity(), m.yield};
    int flows = 0;
    for (int cycle = 0; cycle < 5; ++cycle)
        for (int k = 0; k < 200; ++k) {
            const double shear = 0.4 * std::sin(2 * M_PI * k / 200.0),
                         skew = 0.4 * (1 - std::cos(2 * M_PI * k / 200.0));
            Mat3 F = Mat3::Identity();
            F(0, 1) = shear, F(0, 2) = skew;
            const Mat3 F_E = F * state.F_P.inverse();
            const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(F_E.transpose() * F_E));
            const Mat3 S =
                eigen.eigenvectors() * eigen.eigenvalues().cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
            const Mat3 F_P_before = state.F_P;
            const PrincipalStretch p = principal_stretch(S);
            const FlowResult r = flow(p, m, 0.01, state);
            if (!r.flowed) continue;
            ++flows;
            // F_P stays symmetric: no spin is stored ...
            ASSERT_LE((state.F_P - state.F_P.transpose()).norm(), 1e-12);
            ASSERT_NEAR(state.F_P.determinant(), 1, 1e-10);
            // ... and the group's rotation takes it, so that every goal R F_P q stays where the flow put it.
            const Mat3 flowed = p.directions * Vec3((p.log_strain - r.elastic_log_strain).array().exp()).asDiagonal() *
                                p.directions.transpose();
            ASSERT_LE((r.spin.toRotationMatrix() * state.F_P - flowed * F_P_before).norm(), 1e-10);
        }
    EXPECT_GT(flows, 500);
}

TEST(plastic_flow, stores_no_more_than_its_largest_ratio) {
    const Material m = ductile(0.02, 1e4);
    PlasticState state{Mat3::Identity(), m.yield};
    for (int i = 0; i < 100; ++i) flow(stretch_of(Vec3(0.3, -0.15, -0.15)), m, 0.1, state);
    const Vec3 p = Eigen::SelfAdjointEigenSolver<Mat3>(state.F_P).eigenvalues();
    EXPECT_LE(p(2) / p(0), kMaxPlasticRatio * (1 + 1e-12));
    EXPECT_GT(p(2) / p(0), 0.99 * kMaxPlasticRatio);
}

TEST(plastic_flow, hardening_stays_below_the_toughness) {
    Material m = ductile(0.05, 30);
    m.hardening = 1;
    m.toughness = 0.2;
    for (double hz : {30.0, 240.0}) {
        PlasticState state{Mat3::Identity(), m.yield};
        for (int k = 0; k < static_cast<int>(100 * hz); ++k) {
            const double e = 0.2 * std::sin(2 * M_PI * k / hz) - std::log(state.F_P(0, 0));
            flow(stretch_of(Vec3(e, -e / 2, -e / 2)), m, 1 / hz, state);
        }
        EXPECT_LE(state.yield, kHardeningCap * m.toughness);
        EXPECT_GT(state.yield, m.yield);
    }
}

TEST(plastic_flow, an_inverted_group_does_not_flow) {
    const Material m = ductile(0.01, 1e4);
    PlasticState state{Mat3::Identity(), m.yield};
    EXPECT_FALSE(flow(principal_stretch(Vec3(-0.5, 1, 2).asDiagonal()), m, 1.0, state).flowed);
    EXPECT_EQ(state.F_P, Mat3::Identity());
}

// Groups of all sorts: some flow far, some a little, some not at all; the last was drawn to nearly all that F_P stores.
std::vector<FlowingGroup> flowing_groups() {
    std::vector<FlowingGroup> groups;
    for (int k = 0; k < 40; ++k) {
        Material m = ductile(0.02, 20.0 * (k % 5));
        m.hardening = 0.1 * (k % 3), m.toughness = 0.2;
        const Mat3 turn = Quat(Eigen::AngleAxisd(0.3 * k, Vec3(1, 2, k).normalized())).toRotationMatrix();
        const Vec3 strain(0.01 * (k % 7), -0.02 * (k % 4), 0.015 * (k % 3));
        PlasticState plastic{Mat3::Identity(), m.yield};
        if (k % 4 > 0) {
            const double drawn = k == 39 ? 0.99 * std::log(kMaxPlasticRatio) : 0.3;
            const Mat3 other = Quat(Eigen::AngleAxisd(0.2 * k, Vec3(k, 1, 2).normalized())).toRotationMatrix();
            plastic.F_P = other * Vec3(std::exp(drawn / 2), 1, std::exp(-drawn / 2)).asDiagonal() * other.transpose();
        }
        groups.push_back(
            {principal_stretch(turn * Vec3(strain.array().exp()).asDiagonal() * turn.transpose()), m, plastic});
    }
    return groups;
}

TEST(plastic_flow, of_four_groups_is_that_of_each_alone) {
    const std::vector<FlowingGroup> groups = flowing_groups();
    size_t n_flowed = 0;
    for (size_t first = 0; first < groups.size(); first += 4) {
        std::vector<FlowingGroup> four(groups.begin() + static_cast<std::ptrdiff_t>(first),
                                       groups.begin() + static_cast<std::ptrdiff_t>(first) + 4);
        std::array<FlowResult, 4> results;
        flow(four, 0.01, SUNDER_BEST_KERNELS(kStretchKernels), results);
        for (size_t i = 0; i < 4; ++i) {
            const FlowingGroup& before = groups[first + i];
            PlasticState alone = before.plastic;
            const FlowResult result = flow(before.stretch, before.material, 0.01, alone);
            n_flowed += result.flowed;
            EXPECT_EQ(four[i].plastic.F_P, alone.F_P) << first + i;
            EXPECT_EQ(four[i].plastic.yield, alone.yield) << first + i;
            EXPECT_EQ(results[i].spin, result.spin) << first + i;
            EXPECT_EQ(results[i].elastic_log_strain, result.elastic_log_strain) << first + i;
            EXPECT_EQ(results[i].flowed, result.flowed) << first + i;
            if (!result.flowed) {
                EXPECT_EQ(alone.F_P, before.plastic.F_P) << first + i;
            }
        }
    }
    EXPECT_GT(n_flowed, 15u);
    EXPECT_LT(n_flowed, groups.size() - 8);
}

TEST(plastic_flow, has_the_same_bits_with_every_instruction_set) {
    const auto all = [&](const char* instructions) {
        setenv("SUNDER_INSTRUCTIONS", instructions, 1);
        std::vector<double> numbers;
        for (FlowingGroup& group : flowing_groups()) {
            const FlowResult result = flow(group.stretch, group.material, 0.01, group.plastic);
            numbers.insert(numbers.end(), group.plastic.F_P.data(), group.plastic.F_P.data() + 9);
            numbers.insert(numbers.end(), result.spin.coeffs().begin(), result.spin.coeffs().end());
        }
        unsetenv("SUNDER_INSTRUCTIONS");
        return numbers;
    };
    EXPECT_EQ(all("portable"), all("avx2"));
    EXPECT_EQ(all("portable"), all(""));
}

}  // namespace
}  // namespace sunder
