#include "solver/matching/bending_shape.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <numbers>
#include <random>

#include "tests/support/thin_sheet.h"

namespace sunder {
namespace {

using test::multiply, test::stepped;
using Sheet = test::ThinSheet;

TEST(bending_shape, sheets_and_rods_are_thin_and_blocks_are_not) {
    const auto count = [](int x, int y, int z) {
        SimulationMesh rest = test::lattice_mesh({{x, y, z}, 0.05, 6, 1000, {}});
        build_one_rings(rest);
        const std::vector<uint8_t> thin = thin_groups(rest);
        return std::accumulate(thin.begin(), thin.end(), size_t{0});
    };
    EXPECT_EQ(count(5, 4, 1), 20u);
    EXPECT_EQ(count(6, 1, 1), 6u);
    EXPECT_EQ(count(4, 4, 2), 0u);
    EXPECT_EQ(count(1, 1, 1), 0u);
}

// A slab that folded in half by its weight took the fold for one to the other side, and flew apart.
TEST(bending_shape, a_fold_that_stays_is_known_beyond_half_a_turn) {
    const double turn = 3.5;  // of each fragment against the last, rad
    Sheet rod(5, 1, 0, false);
    std::vector<MovingParticle> at = rod.moved(0);
    for (size_t i = 0; i < at.size(); ++i) {
        const Vec3 about = rod.rest.rest_orientation[i] * Vec3(0, 0, turn * double(i));
        at[i].d = rotation_of(about);
    }
    std::vector<BentMember> members(rod.live.count(2));
    const double spacing = (rod.rest.rest_position[1] - rod.rest.rest_position[0]).norm();
    const auto curvature = [&] {
        rod.update();
        return bend(rod.bending, rod.live, at, 2, members).K.norm() * spacing;
    };
    EXPECT_NEAR(curvature(), 2 * std::numbers::pi - turn, 1e-9);  // nothing says otherwise
    const Mat3 read = bend(rod.bending, rod.live, at, 2, members).K;
    rod.curvature[2] = read * (-2.9 / (2 * std::numbers::pi - turn));
    EXPECT_NEAR(curvature(), turn, 1e-9);
    rod.curvature[2] = -rod.curvature[2];
    EXPECT_NEAR(curvature(), 2 * std::numbers::pi - turn, 1e-9);
}

TEST(bending_shape, forces_are_the_slope_of_the_energy) {
    for (const auto& [nx, ny, nz] : test::kSheets)
        for (const int kind : {0, 1, 2}) {
            const bool with_pin = kind == 1;
            Sheet sheet(nx, ny, nz > 1 ? 0.3 : 0.0, with_pin, nz);
            if (kind == 2) sheet.let_go(sheet.moved(0.5));
            std::vector<MovingParticle> at = sheet.moved(1);
            const Eigen::VectorXd forces = sheet.forces(at);
            const double most = forces.cwiseAbs().maxCoeff();
            double worst = 0;
            for (size_t j = 0; j < at.size(); ++j)
                for (int c = 0; c < 6; ++c) {
                    if (sheet.pinned[j]) continue;
                    const MovingParticle was = at[j];
                    const double by = c < 3 ? 1e-7 : 1e-6;
                    at[j] = stepped(was, c, by);
                    const double after = sheet.energy(at);
                    at[j] = stepped(was, c, -by);
                    const double before = sheet.energy(at);
                    at[j] = was;
                    const double force = forces[static_cast<Eigen::Index>(6 * j) + c];
                    worst = std::max(worst, std::abs((before - after) / (2 * by) - force));
                }
            EXPECT_LT(worst, 1e-6 * most) << nx << " by " << ny << (with_pin ? " with a pin" : "");
        }
}

TEST(bending_shape, what_no_bent_shape_explains_bears_nothing_when_it_is_let_go) {
    for (const auto& [nx, ny, nz] : test::kSheets)
        for (const bool with_pin : {false, true}) {
            Sheet sheet(nx, ny, 0.3, with_pin, nz);
            const std::vector<MovingParticle> at = sheet.moved(1);
            const auto groups = [&] {
                std::vector<BentGroup> all;
                std::vector<BentMember> members;
                for (uint32_t g = 0; g < at.size(); ++g) {
                    if (!sheet.bending.pulls(g)) continue;
                    members.resize(sheet.live.count(g));
                    all.push_back(bend(sheet.bending, sheet.live, at, g, members));
                    const Unexplained rest = unexplained(sheet.bending, sheet.live, g, members);
                    const BendingShape& s = sheet.bending.shape(g);
                    EXPECT_NEAR(0.5 * s.youngs_modulus() * s.volume * (rest.stretch + rest.bend), all.back().rest,
                                1e-12 * all.back().energy());
                }
                return all;
            };
            const std::vector<BentGroup> before = groups();
            sheet.let_go(at);
            const std::vector<BentGroup> after = groups();
            ASSERT_EQ(after.size(), before.size());
            for (size_t g = 0; g < after.size(); ++g) {
                const double whole = before[g].energy();
                EXPECT_LT(after[g].rest, 1e-12 * whole);
                EXPECT_NEAR(after[g].bend, before[g].bend, 1e-12 * whole);
                EXPECT_NEAR(after[g].stretch, before[g].stretch, 1e-12 * whole);
            }
        }
}

TEST(bending_shape, forces_have_no_sum_and_no_moment) {
    const Sheet sheet(4, 3, 0.3, false);
    const std::vector<MovingParticle> at = sheet.moved(1);
    const Eigen::VectorXd forces = sheet.forces(at);
    const test::Sums sums = test::sums_of(forces, at);
    EXPECT_LT(sums.force.norm(), 1e-12 * forces.norm());
    EXPECT_LT(sums.moment.norm(), 1e-12 * forces.norm());
}

// Of the forces, by a motion z of the particles.
Eigen::VectorXd lost_by(const Sheet& sheet, std::span<const MovingParticle> at, const Eigen::VectorXd& z) {
    std::vector<MovingParticle> ahead(at.begin(), at.end()), back = ahead;
    const double by = 1e-6;
    for (size_t j = 0; j < at.size(); ++j)
        for (int c = 0; c < 6; ++c) {
            ahead[j] = stepped(ahead[j], c, by * z[static_cast<Eigen::Index>(6 * j) + c]);
            back[j] = stepped(back[j], c, -by * z[static_cast<Eigen::Index>(6 * j) + c]);
        }
    return (sheet.forces(back) - sheet.forces(ahead)) / (2 * by);
}

// A wave across the sheet, whose fragments turn with it: what it is drawn by resists it, and more than it bends.
TEST(bending_shape, what_is_drawn_resists_what_tilts_it) {
    for (const auto& [nx, ny] : {std::pair(12, 3), std::pair(12, 1)})
        for (const double drawn : {0.0, 0.02}) {
            Sheet sheet(nx, ny, 0.3, false);
            constexpr double kFlat = 0.2;  // of a fragment's width, its thickness
            for (Vec3& radii : sheet.rest.radii) radii.z() *= kFlat;
            for (double& volume : sheet.rest.volume) volume *= kFlat;
            for (double& mass : sheet.rest.mass) mass *= kFlat;
            for (Edge& edge : sheet.rest.edges) edge.area *= kFlat;
            sheet.rest.group_trace.clear();
            sheet.update();
            std::vector<MovingParticle> at = sheet.moved(0);
            Vec3 center = Vec3::Zero();
            for (const MovingParticle& p : at) center += p.x / static_cast<double>(at.size());
            Mat3 moment = Mat3::Zero();
            for (const MovingParticle& p : at) moment += (p.x - center) * (p.x - center).transpose();
            const Eigen::SelfAdjointEigenSolver<Mat3> axes(moment);
            const Vec3 along = axes.eigenvectors().col(2), across = axes.eigenvectors().col(0),
                       about = across.cross(along);
            const double k = 2 * std::acos(-1.0) / 0.6;  // 0.6 m long
            Eigen::VectorXd z(static_cast<Eigen::Index>(6 * at.size()));
            for (size_t j = 0; j < at.size(); ++j) {
                const double s = along.dot(at[j].x - center);
                at[j].x += drawn * s * along;
                z.segment<3>(static_cast<Eigen::Index>(6 * j)) = std::sin(k * s) / k * across;
                z.segment<3>(static_cast<Eigen::Index>(6 * j + 3)) = -std::cos(k * s) * about;
            }
            LaneLayout layout;
            layout.update(sheet.live, sheet.workers);
            const std::vector<double> span(at.size(), 1.0);
            const std::vector<Role> role(at.size(), Role::free);
            const SweepInput in{sheet.rest, sheet.live, sheet.shapes, sheet.stiffness, role,
                                span,       {},         {},           &sheet.bending};
            BendingUnit<double> unit;
            ASSERT_TRUE(unit.open(in, layout, 0));
            unit.linearise(in, at, UnitBlocks(layout.n_blocks(), nullptr), {});
            Eigen::VectorXd found = Eigen::VectorXd::Zero(z.size());
            multiply(sheet, layout, unit.arrays(), z, found);
            const double wanted = z.dot(lost_by(sheet, at, z));
            EXPECT_NEAR(z.dot(found) / wanted, 1, 0.05) << nx << " by " << ny << " drawn by " << drawn;
        }
}

// Where nothing is strained the Hessian is all there is: the change of the forces.
TEST(bending_shape, products_are_what_a_small_motion_changes) {
    for (const auto& [nx, ny, nz] : test::kSheets)
        for (const bool with_pin : {false, true}) {
            const Sheet sheet(nx, ny, 0.3, with_pin, nz);
            const std::vector<MovingParticle> at = sheet.moved(0);
            EXPECT_LT(sheet.energy(at), 1e-20);
            LaneLayout layout;
            layout.update(sheet.live, sheet.workers);
            ASSERT_EQ(layout.units().size(), 1u);
            const std::vector<double> span(at.size(), 1.0);
            std::vector<Role> role(at.size(), Role::free);
            if (with_pin) role[0] = Role::held;
            const SweepInput in{sheet.rest, sheet.live, sheet.shapes, sheet.stiffness, role,
                                span,       {},         {},           &sheet.bending};
            BendingUnit<double> unit;
            ASSERT_TRUE(unit.open(in, layout, 0));
            const UnitBlocks blocks(layout.n_blocks(), nullptr);
            unit.linearise(in, at, blocks, {});
            std::mt19937 random(2);
            std::normal_distribution<double> normal;
            const auto n = static_cast<Eigen::Index>(6 * at.size());
            Eigen::VectorXd z(n);
            for (Eigen::Index i = 0; i < n; ++i) z[i] = (i % 6 < 3 ? 0.05 : 1.0) * normal(random);
            for (size_t j = 0; j < at.size(); ++j)
                if (sheet.pinned[j]) z.segment<6>(static_cast<Eigen::Index>(6 * j)).setZero();
            const Eigen::VectorXd wanted = lost_by(sheet, at, z);
            Eigen::VectorXd found = Eigen::VectorXd::Zero(n);
            multiply(sheet, layout, unit.arrays(), z, found);
            for (size_t j = 0; j < at.size(); ++j)
                if (sheet.pinned[j]) found.segment<6>(static_cast<Eigen::Index>(6 * j)).setZero();
            Eigen::VectorXd compared = wanted;
            for (size_t j = 0; j < at.size(); ++j)
                if (sheet.pinned[j]) compared.segment<6>(static_cast<Eigen::Index>(6 * j)).setZero();
            EXPECT_LT((found - compared).norm(), 1e-5 * compared.norm()) << nx << " by " << ny << with_pin;
        }
}

}  // namespace
}  // namespace sunder
