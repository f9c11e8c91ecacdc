#include "solver/matching/section_flow.h"

#include <gtest/gtest.h>

#include "tests/support/thin_sheet.h"

namespace sunder {
namespace {

using test::SheetFlow, test::ThinSheet;

constexpr double kYield = 1e-4;

TEST(section_flow, what_flows_takes_energy) {
    for (const auto& [nx, ny] : {std::pair(4, 3), std::pair(5, 1)}) {
        const ThinSheet sheet(nx, ny, 0.3, false);
        const SheetFlow flow(sheet, kYield, 1);
        const std::vector<MovingParticle> at = sheet.moved(0.01);
        size_t flowing = 0;
        for (uint32_t g = 0; g < at.size(); ++g) {
            std::vector<BentMember> members(sheet.live.count(g));
            const BentGroup group = bend(sheet.bending, sheet.live, at, g, members);
            const BendingShape& s = sheet.bending.shape(g);
            const SectionFlow of = sheet.flow_of(g, group, members, &flow.within);
            if (!of.flows()) continue;
            ++flowing;
            const SectionStrain before = section_strain(s, group, Mat3::Zero());
            SectionStrain left = before;
            left.stretch -= of.flowed.stretch, left.K -= of.flowed.K;
            // The work of the stress that is left: of what flows, and no more than all there was.
            const auto energy = [&](const SectionStrain& a, const SectionStrain& b) {
                const Eigen::Map<const Vec9> K(a.K.data()), other(b.K.data());
                return s.volume * (2 * s.mu * a.stretch.cwiseProduct(b.stretch).sum() +
                                   s.pressure() * a.stretch.trace() * b.stretch.trace()) +
                       K.dot(s.bending * other);
            };
            EXPECT_GT(energy(left, of.flowed), 0);
            EXPECT_LT(energy(left, left), energy(before, before));
        }
        EXPECT_GT(flowing, at.size() / 2);
    }
}

TEST(section_flow, what_is_below_the_yield_surface_flows_by_nothing) {
    for (const auto& [nx, ny] : {std::pair(4, 3), std::pair(5, 1)}) {
        const ThinSheet sheet(nx, ny, 0.3, false);
        const SheetFlow flow(sheet, 0.1, 1);
        const std::vector<MovingParticle> at = sheet.moved(0.01);
        EXPECT_EQ(sheet.forces(at, &flow.within), sheet.forces(at));
    }
}

TEST(section_flow, forces_of_what_flows_have_no_sum_and_no_moment) {
    const ThinSheet sheet(4, 3, 0.3, false);
    const SheetFlow flow(sheet, kYield, 0.7);
    const std::vector<MovingParticle> at = sheet.moved(1);
    const Eigen::VectorXd forces = sheet.forces(at, &flow.within);
    EXPECT_LT(forces.norm(), 0.9 * sheet.forces(at).norm());
    const test::Sums sums = test::sums_of(forces, at);
    EXPECT_LT(sums.force.norm(), 1e-12 * forces.norm());
    EXPECT_LT(sums.moment.norm(), 1e-12 * forces.norm());
}

}  // namespace
}  // namespace sunder
