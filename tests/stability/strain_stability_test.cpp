// What a group reads off a homogeneous deformation, and what flows there (rows 10, 12, 14, 15, 17).
#include <gtest/gtest.h>

#include "tests/stability/bars.h"
#include "tests/support/flow.h"
#include "tests/support/reference_stretch.h"

namespace sunder {
namespace {

using test::flow;
using test::PlainMethod;
using test::PlainSettings;
using test::principal_stretch;

// A block of particles that someone moves by a homogeneous deformation; groups read it, nothing relaxes.
struct Block {
    Scene scene;
    Material material;
    std::unique_ptr<Solver> solver;
    FrameState ours, plain_state;
    std::unique_ptr<PlainMethod> plain;

    explicit Block(int neighbours = 6, double radius_over_spacing = 0.5) {
        SimulationMesh mesh = test::lattice_mesh({{5, 5, 5}, 0.05, neighbours, 1000, {}});
        for (Vec3& r : mesh.radii) r.setConstant(radius_over_spacing * 0.05);
        test::add_body(scene, mesh);
        material.stiffness = 0;
        material.toughness = 10;
    }
    void start() {
        solver = test::make_solver(scene);
        ours = plain_state = solver->initial_state({material});
        plain = std::make_unique<PlainMethod>(scene);
    }
    void deform(const Mat3& F, FrameState& io_state) const {
        for (size_t i = 0; i < io_state.n_particles(); ++i) {
            io_state.position[i] = F * scene.rest.rest_position[i];
            io_state.velocity[i].setZero();
        }
    }
    // One step of the plain method with the block held at F.
    void plain_step(const Mat3& F, double h, double flow_per_step) {
        deform(F, plain_state);
        EXPECT_TRUE(
            plain->advance(test::quiet_input(scene, material, h), {.flow_per_step = flow_per_step}, plain_state));
    }
    size_t center() const { return scene.rest.n_particles() / 2; }
};

Mat3 stretch(double x, double y, double z) { return Vec3(std::exp(x), std::exp(y), std::exp(z)).asDiagonal(); }

TEST(strain_bias, radius_neighbourhood_and_surface_hardly_change_what_strain_is_read) {
    const double truth = std::log(1.2);
    for (const int neighbours : {6, 26})
        for (const double radius : {0.25, 0.5, 0.62}) {
            Block block(neighbours, radius);
            block.start();
            const Mat3 F = Vec3(1, 1, 1.2).asDiagonal();
            block.deform(F, block.ours);
            test::advance(*block.solver, test::quiet_input(block.scene, block.material, 1e-6),
                          {.substeps = 1, .self_collision = false}, block.ours);  // too short for anything to move
            block.plain_step(F, 1e-6, 0);
            const double inside = block.ours.strain[block.center()] / truth, corner = block.ours.strain[0] / truth;
            std::printf(
                "%2d neighbours, radius %.2f of the spacing: %.3f inside, %.3f at a corner; "
                "plain method %.3f, %.3f\n",
                neighbours, radius, inside, corner, block.plain_state.strain[block.center()] / truth,
                block.plain_state.strain[0] / truth);
            EXPECT_GE(inside, 0.97);
            EXPECT_GE(corner, 0.85);
            EXPECT_LE(inside, 1 + 1e-6);
            EXPECT_LT(block.plain_state.strain[block.center()], block.ours.strain[block.center()]);
        }
}

// Plastic part of the largest log strain of the middle group after 0.1 s at a held strain.
double plain_flow_in_a_tenth_of_a_second(int steps_a_second) {
    Block block;
    block.material.yield = 0.05;
    block.start();
    const int steps = static_cast<int>(std::lround(0.1 * steps_a_second));
    for (int k = 0; k < steps; ++k) block.plain_step(stretch(-0.1, -0.1, 0.2), 0.1 / steps, 0.02);
    return std::log(block.plain_state.plastic_deformation[block.center()](2, 2));
}

double flow_in_a_tenth_of_a_second(int steps_a_second) {
    Material material;
    material.flow_rate = 1.2;
    PlasticState state{Mat3::Identity(), 0.05};
    const int steps = static_cast<int>(std::lround(0.1 * steps_a_second));
    for (int k = 0; k < steps; ++k) {
        const double plastic = std::log(state.F_P(2, 2));
        const Vec3 elastic(-0.1 + 0.5 * plastic, -0.1 + 0.5 * plastic, 0.2 - plastic);
        flow(principal_stretch(Vec3(elastic.array().exp()).asDiagonal()), material, 0.1 / steps, state);
    }
    return std::log(state.F_P(2, 2));
}

TEST(flow_and_step, what_flows_in_a_time_depends_on_the_step_in_the_plain_method_alone) {
    for (const int hz : {30, 60, 240, 1000})
        std::printf("%4d Hz: %.4f has flowed; plain method %.4f\n", hz, flow_in_a_tenth_of_a_second(hz),
                    plain_flow_in_a_tenth_of_a_second(hz));
    EXPECT_NEAR(flow_in_a_tenth_of_a_second(1000), flow_in_a_tenth_of_a_second(30),
                0.01 * flow_in_a_tenth_of_a_second(30));
    EXPECT_GT(plain_flow_in_a_tenth_of_a_second(1000), 3 * plain_flow_in_a_tenth_of_a_second(30));
}

TEST(melt, pressure_lets_the_plain_method_flow_below_yield) {
    // Each axis shortened by 0.12 and a shear of 0.05 with a yield of 0.1: the shear alone does not yield.
    const Vec3 log_strain(-0.12 + 0.05, -0.12 - 0.05, -0.12);
    Block block;
    block.material.yield = 0.1;
    block.start();
    for (int k = 0; k < 240; ++k)
        block.plain_step(stretch(log_strain.x(), log_strain.y(), log_strain.z()), 1 / 60., 0.2);
    Material material;
    PlasticState state{Mat3::Identity(), 0.1};
    flow(principal_stretch(Vec3(log_strain.array().exp()).asDiagonal()), material, 4, state);
    const Vec3 flowed = block.plain_state.plastic_deformation[block.center()].diagonal().array().log();
    std::printf("plain method: %.0f %% of the shear has flowed below yield\n", 100 * flowed.x() / 0.05);
    EXPECT_EQ(state.F_P, Mat3::Identity());
    EXPECT_GT(flowed.x(), 0.5 * 0.05);
}

TEST(plastic_spin, a_closed_shear_loop_turns_the_plain_methods_plastic_deformation) {
    Block block;
    block.material.yield = 0.02;
    block.start();
    for (int cycle = 0; cycle < 5; ++cycle)
        for (int k = 0; k < 100; ++k) {
            const double phase = 2 * M_PI * (k + 1) / 100;
            Mat3 F = Mat3::Identity();
            F(0, 1) = 0.5 * std::sin(phase), F(0, 0) = std::exp(0.3 * (std::cos(phase) - 1)), F(1, 1) = 1 / F(0, 0);
            block.plain_step(F, 1 / 60., 0.5);
        }
    const Eigen::JacobiSVD<Mat3> svd(block.plain_state.plastic_deformation[block.center()],
                                     Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double spin = Eigen::AngleAxisd(Mat3(svd.matrixU() * svd.matrixV().transpose())).angle() / test::kDegree;
    std::printf("plain method: F_P turned by %.1f degrees in five loops\n", spin);
    EXPECT_GT(spin, 0.1);
}

TEST(hardening, grows_with_time_in_the_plain_method_and_with_plastic_strain_in_sunder) {
    double ours[2], plain[2];
    for (const int fast : {0, 1}) {
        const int hz = fast ? 240 : 30;
        Block block;
        block.material.yield = 0.05;
        block.material.hardening = 1;
        block.start();
        for (int k = 0; k < hz; ++k) block.plain_step(stretch(-0.1, -0.1, 0.2), 1.0 / hz, 0.2);
        plain[fast] = block.plain_state.yield[block.center()];

        Material material = block.material;
        material.flow_rate = 1.2, material.toughness = 0.15;
        PlasticState state{Mat3::Identity(), 0.05};
        for (int k = 0; k < 100 * hz; ++k) {  // 100 cycles of a second
            const double e = 0.2 * std::sin(2 * M_PI * (k + 1) / hz), p = std::log(state.F_P(2, 2));
            flow(principal_stretch(stretch(-0.5 * (e - p), -0.5 * (e - p), e - p)), material, 1.0 / hz, state);
        }
        ours[fast] = state.yield;
    }
    std::printf("yield at 30 and 240 Hz: %.4f, %.4f after 100 cycles; plain method %.4f, %.4f after a second held\n",
                ours[0], ours[1], plain[0], plain[1]);
    EXPECT_NEAR(ours[1], ours[0], 0.02 * ours[0]);
    EXPECT_LE(ours[1], kHardeningCap * 0.15);
    EXPECT_GT(std::abs(plain[1] - plain[0]), 0.02 * plain[0]);
}

}  // namespace
}  // namespace sunder
