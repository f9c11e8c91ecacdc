#include "solver/material/bending_flow.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/thin_sheet.h"

namespace sunder {
namespace {

constexpr double kYield = 0.002, kNu = 0.3, kToDeviator = 2.0 / 3 * (1 + kNu);  // of a uniaxial strain

// A flat sheet across z, or a rod along x, which is stretched along x by `strain` and as free as it can be across.
struct Section {
    BendingShape shape;
    BentGroup group;
    Material material;
    BendingPlasticity plastic;

    explicit Section(int rank, double strain = 0) {
        shape.rank = rank, shape.normal = 2, shape.axis = 0;
        shape.axes.setIdentity();
        shape.extent = Vec3(0.04, 0.02, 0.01);
        shape.volume = shape.extent.prod(), shape.nu = kNu, shape.mu = 1e9;
        shape.spanned = (rank == 2 ? Vec3(1, 1, 0) : Vec3(1, 0, 0)).asDiagonal();
        group.axes.setIdentity(), group.K.setZero(), group.R.setIdentity();
        group.F = shape.spanned;
        group.F(0, 0) = std::exp(strain);
        if (rank == 2) group.F(1, 1) = std::exp(-kNu * strain);
        material.flow_rate = 1e9;
        plastic.yield = kYield;
    }
    BentFlow flow(const Unexplained& rest) { return flow_bending(shape, group, rest, material, 1, plastic); }
};

// The square of a uniaxial strain whose deviator is that many times the yield.
double square_of(double yields) { return std::pow(yields * kYield / kToDeviator, 2); }

TEST(bending_flow, what_no_bent_shape_explains_flows_to_the_yield_surface) {
    for (const int rank : {1, 2}) {
        Section section(rank);
        EXPECT_FALSE(section.flow({square_of(0.99), 0}).flows());
        const BentFlow flow = section.flow({square_of(2), 0});
        EXPECT_TRUE(flow.flows());
        EXPECT_NEAR(flow.stretch_share, 0.5, 1e-12);  // what is left is the yield
        EXPECT_LT((section.plastic.F_P - Mat3::Identity()).norm(), 1e-15);
        EXPECT_EQ(section.plastic.K_P, Mat3::Zero());
    }
}

TEST(bending_flow, what_bends_flows_from_the_faces_inwards) {
    Section section(2);
    EXPECT_FALSE(section.flow({0, square_of(0.99 / std::sqrt(2.0))}).flows());
    // The outermost of five layers bear root 2 of the mean, those beside the middle root 1/2.
    const BentFlow flow = section.flow({0, square_of(0.9)});
    const double outermost = 1 - 1 / (0.9 * std::sqrt(2.0));
    EXPECT_NEAR(flow.bend_share, 2 * 2 * outermost / 5, 1e-12);
    EXPECT_NEAR(flow.stretch_share, 2 * outermost / 5, 1e-12);
}

TEST(bending_flow, with_the_stretch_it_yields_as_one_material) {
    for (const int rank : {1, 2}) {
        const double strain = kYield / kToDeviator;
        Section section(rank, strain), alone(rank, strain * (1 - 1e-9));
        EXPECT_FALSE(alone.flow({}).flows());
        const BentFlow flow = section.flow({square_of(1), 0});
        EXPECT_NEAR(flow.stretch_share, 1 - 1 / std::sqrt(2.0), 1e-9);
        EXPECT_NEAR(std::log(section.plastic.F_P(0, 0)), flow.stretch_share * kToDeviator * strain, 1e-9);
        EXPECT_NEAR(section.plastic.F_P.determinant(), 1, 1e-12);
    }
}

// A step's forces are those of the material as it has flowed by its end: to the order of its strains.
TEST(bending_flow, leaves_the_forces_that_the_step_had) {
    for (const auto& [nx, ny, nz] : test::kSheets)
        for (const double share : {0.4, 1.0}) {
            test::ThinSheet sheet(nx, ny, kNu, false, nz);
            const test::SheetFlow flow(sheet, 1e-4, share);
            const std::vector<MovingParticle> at = sheet.moved(0.01);
            const Eigen::VectorXd elastic = sheet.forces(at), within = sheet.forces(at, &flow.within);
            sheet.offset.assign(sheet.rest.n_edges(), EdgeOffsets());
            for (uint32_t g = 0; g < at.size(); ++g) {
                std::vector<BentMember> members(sheet.live.count(g));
                const BendingShape& s = sheet.bending.shape(g);
                const BentGroup group = bend(sheet.bending, sheet.live, at, g, members);
                Material material;
                material.flow_rate = share < 1 ? -std::log(1 - share) : 1e9;
                BendingPlasticity plastic;
                plastic.yield = 1e-4;
                const BentFlow of =
                    flow_bending(s, group, unexplained(sheet.bending, sheet.live, g, members), material, 1, plastic);
                EXPECT_TRUE(of.flows());
                sheet.plastic[g] = plastic.F_P, sheet.curvature[g] = plastic.K_P;
                sheet.offset_members(g, members, of.stretch_share, of.bend_share);
            }
            sheet.update();
            const Eigen::VectorXd after = sheet.forces(at);
            EXPECT_LT(within.norm(), (1 - 0.2 * share) * elastic.norm());
            EXPECT_LT((after - within).norm(), 0.01 * elastic.norm()) << nx << " by " << ny << ", " << share;
        }
}

TEST(bending_flow, principal_strains_of_a_face_are_those_of_its_matrix) {
    BendingShape shape;
    shape.rank = 2, shape.normal = 1;
    shape.axes = rotation_of(Vec3(0.3, -0.8, 0.4)).toRotationMatrix();
    for (const Vec3& e : {Vec3(0.02, -0.01, 0.03), Vec3(-0.01, 0.02, 0.03), Vec3(0.01, 0.01, 0), Vec3::Zero().eval()}) {
        Mat3 strain = Mat3::Zero();
        strain(0, 0) = e[0], strain(2, 2) = e[1], strain(0, 2) = strain(2, 0) = e[2], strain(1, 1) = -0.004;
        const FacePrincipal of = principal_of(shape, strain);
        const Mat3 whole = of.directions * of.strain.asDiagonal() * of.directions.transpose();
        EXPECT_LT((whole - shape.axes * strain * shape.axes.transpose()).norm(), 1e-16);
        EXPECT_LT((of.directions.transpose() * of.directions - Mat3::Identity()).norm(), 1e-14);
    }
}

}  // namespace
}  // namespace sunder
