#include "solver/matching/bent_kernels.h"

#include <gtest/gtest.h>

#include "tests/support/thin_sheet.h"

namespace sunder {
namespace {

using Sheet = test::ThinSheet;

struct Unit {
    LaneLayout layout;
    std::vector<double> span;
    std::vector<Role> role;
    BendingUnit<double> unit;

    Unit(const Sheet& sheet, std::span<const MovingParticle> at, const FlowWithin* flow)
        : span(at.size(), 0.7), role(at.size(), Role::free) {
        layout.update(sheet.live, sheet.workers);
        for (size_t j = 0; j < at.size(); ++j)
            if (sheet.pinned[j]) role[j] = Role::held;
        const SweepInput in{sheet.rest, sheet.live, sheet.shapes, sheet.stiffness, role,
                            span,       {},         {},           &sheet.bending,  flow};
        EXPECT_TRUE(unit.open(in, layout, 0));
        unit.linearise(in, at, UnitBlocks(layout.n_blocks(), nullptr), {});
    }
    // Calls body(particle, pull) for all that groups do to particles.
    template <class Body>
    void for_pulls(const Sheet& sheet, const Body& body) const {
        for (uint32_t g = 0; g < span.size(); ++g) {
            if (!sheet.bending.pulls(g)) continue;
            const uint32_t lane = layout.lane(g), first = layout.row_begin(0)[lane / kLanes];
            for (uint32_t slot = sheet.live.begin(g); slot < sheet.live.end(g); ++slot)
                body(sheet.live.member(slot),
                     unit.pulls()[kLanes * (first + slot - sheet.live.begin(g)) + lane % kLanes]);
        }
    }
};

std::vector<const BentKernels*> kernel_sets() {
    std::vector<const BentKernels*> all = {&kBentKernelsPortable};
#ifdef SUNDER_HAS_AVX
    if (instruction_set() != InstructionSet::portable) all.push_back(&kBentKernelsAvx2);
    if (instruction_set() == InstructionSet::avx512) all.push_back(&kBentKernelsAvx512);
#endif
    return all;
}

// Neighbours turn against one another by little, by some 20 degrees, and by up to half a turn; and by up to three
// quarters where they are folded for good.
TEST(bent_kernels, a_group_is_bent_as_it_is_alone_whatever_is_beside_it) {
    for (const auto& [nx, ny, nz] : test::kSheets)
        for (const bool with_pin : {false, true})
            for (const auto& [amount, folded] : {std::pair(0.01, 0.0), {1.0, 0.0}, {8.0, 0.0}, {8.0, 60.0}}) {
                Sheet sheet(nx, ny, 0.3, with_pin, nz);
                for (Mat3& K_P : sheet.curvature) K_P(1, 0) = folded, K_P(0, 1) = -folded;
                sheet.update();
                const std::vector<MovingParticle> at = sheet.moved(amount);
                const BentRecords records = bent_records(sheet.bending, sheet.live, at);
                for (uint32_t g = 0; g < at.size(); ++g) {
                    if (!sheet.bending.pulls(g)) continue;
                    std::vector<BentMember> members(sheet.live.count(g));
                    const BentGroup wanted = bend(sheet.bending, sheet.live, at, g, members);
                    uint32_t other = g;
                    do other = (other + 5) % static_cast<uint32_t>(at.size());
                    while (!sheet.bending.pulls(other));
                    const uint32_t groups[4] = {other, g, other, other};
                    std::vector<BentRow> rows(std::max(sheet.live.count(g), sheet.live.count(other)));
                    std::vector<BentShape> found;
                    for (const BentKernels* kernels : kernel_sets()) {
                        BentGroups four;
                        kernels->bend(records, groups, rows.size(), true, four, rows.data());
                        found.push_back(bent_shape(four, 1));
                        for (int i = 0; i < 9; ++i)
                            EXPECT_NEAR(four.axes[i / 3][i % 3][1], wanted.axes(i / 3, i % 3), 1e-14);
                        EXPECT_EQ(found.back().F, found.front().F);
                        EXPECT_EQ(found.back().R, found.front().R);
                        EXPECT_EQ(found.back().K, found.front().K);
                        const Quat goal(four.rotation[3][1], four.rotation[0][1], four.rotation[1][1],
                                        four.rotation[2][1]);
                        const Mat3 R = wanted.axes * wanted.R * sheet.bending.shape(g).axes.transpose();
                        EXPECT_LT((goal.toRotationMatrix() - R).norm(), 1e-11);
                        const Unexplained rest = unexplained(sheet.bending, sheet.live, g, members),
                                          of_four = unexplained(sheet.bending.shape(g), four, 1);
                        EXPECT_NEAR(of_four.stretch, rest.stretch, 1e-10 * (rest.stretch + rest.bend) + 1e-20);
                        EXPECT_NEAR(of_four.bend, rest.bend, 1e-10 * (rest.stretch + rest.bend) + 1e-20);
                    }
                    EXPECT_LT((found[0].K - wanted.K).norm(), 1e-12 * wanted.K.norm());
                    EXPECT_LT((found[0].F - wanted.F).norm(), 1e-10 * wanted.F.norm());
                    EXPECT_LT((found[0].R - wanted.R).norm(), 1e-11);
                    double worst = 0;
                    std::vector<BentMember> of_four(members.size());
                    bent_members(rows, 1, of_four);
                    for (size_t j = 0; j < members.size(); ++j) {
                        const Mat3 turn_rate = members[j].turn_rate, arc_rate = members[j].arc_rate;
                        worst = std::max(worst, (of_four[j].sigma - members[j].sigma).norm());
                        for (int i = 0; i < 3; ++i)
                            for (int k = 0; k < 3; ++k)
                                worst = std::max({worst, std::abs(rows[j].turn_rate[i][k][1] - turn_rate(i, k)),
                                                  std::abs(rows[j].arc_rate[i][k][1] - arc_rate(i, k))});
                    }
                    EXPECT_LT(worst, 1e-9) << "by " << amount;  // the series of arc.h end at 1e-10
                }
            }
}

TEST(bent_kernels, forces_are_those_of_each_group_with_what_flows_of_them) {
    for (const auto& [nx, ny, nz] : test::kSheets)
        for (const bool with_pin : {false, true})
            for (const bool flows : {false, true}) {
                Sheet sheet(nx, ny, 0.3, with_pin, nz);
                const std::vector<MovingParticle> at = sheet.moved(1);
                const test::SheetFlow flow(sheet, 0.01, 0.5);
                const FlowWithin* const within = flows ? &flow.within : nullptr;
                const Eigen::VectorXd wanted = 0.7 * 0.7 * sheet.forces(at, within);
                Eigen::VectorXd found = Eigen::VectorXd::Zero(wanted.size());
                Unit(sheet, at, within).for_pulls(sheet, [&](ParticleIndex j, const BentPull& pull) {
                    const auto first = static_cast<Eigen::Index>(6 * size_t{j});
                    found.segment<3>(first) += Vec3(pull.force[0], pull.force[1], pull.force[2]);
                    found.segment<3>(first + 3) += Vec3(pull.torque[0], pull.torque[1], pull.torque[2]);
                });
                EXPECT_LT((found - wanted).norm(), 1e-8 * wanted.norm());
            }
}

// Of one particle that moves alone, what is read at itself.
TEST(bent_kernels, the_diagonal_is_that_of_the_products) {
    for (const auto& [nx, ny, nz] : test::kSheets)
        for (const bool with_pin : {false, true}) {
            const Sheet sheet(nx, ny, 0.3, with_pin, nz);
            const std::vector<MovingParticle> at = sheet.moved(0);
            const Unit unit(sheet, at, nullptr);
            std::vector<Sym3> shift(at.size(), Sym3{}), turn = shift;
            unit.for_pulls(sheet, [&](ParticleIndex j, const BentPull& pull) {
                for (size_t i = 0; i < 6; ++i) shift[j][i] += pull.shift_block[i], turn[j][i] += pull.turn_block[i];
            });
            const auto n = static_cast<Eigen::Index>(6 * at.size());
            for (size_t j = 0; j < at.size(); ++j) {
                if (sheet.pinned[j]) continue;
                for (Eigen::Index c = 0; c < 6; ++c) {
                    const auto first = static_cast<Eigen::Index>(6 * j);
                    Eigen::VectorXd z = Eigen::VectorXd::Zero(n), product = z;
                    z[first + c] = 1;
                    multiply(sheet, unit.layout, unit.unit.arrays(), z, product);
                    const Mat3 block = to_matrix(c < 3 ? shift[j] : turn[j]);
                    const Vec3 found = product.segment<3>(first + (c < 3 ? 0 : 3));
                    EXPECT_LT((found - block.col(c % 3)).norm(), 1e-9 * block.norm()) << j << " along " << c;
                }
            }
        }
}

}  // namespace
}  // namespace sunder
