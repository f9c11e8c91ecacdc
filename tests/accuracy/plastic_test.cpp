// What a plastic twist or bend leaves behind, against J2 plasticity by finite elements (row 25 of the numerical study).
#include "tests/accuracy/bar_cases.h"

namespace sunder {
namespace {

using namespace test;

// Degrees that the residual angle lies above the reference's.
double residual_error(const char* name, Load load, double most, double yield, int n, int neighbours) {
    BarSetup setup;
    setup.load = load, setup.n = n, setup.neighbours = neighbours, setup.yield = yield;
    const double residual = load_and_unload(setup, most).residual, reference = reference_residual(name);
    std::printf("%s, n = %d, %d neighbours: %.1f degrees left, reference %.1f\n", name, n, neighbours, residual,
                reference);
    return residual - reference;
}

class ResidualTwist : public ::testing::TestWithParam<int> {};

TEST_P(ResidualTwist, is_within_ten_degrees_and_falls_as_yield_rises) {
    double last = 90;
    for (const auto& [name, yield] : {std::pair{"twist90_j2_yield0.02", 0.02}, std::pair{"twist90_j2_yield0.04", 0.04},
                                      std::pair{"twist90_j2_yield0.06", 0.06}}) {
        const double error = residual_error(name, Load::twist, 90, yield, 6, GetParam());
        EXPECT_LE(std::abs(error), 10);
        const double residual = reference_residual(name) + error;
        EXPECT_LT(residual, last);
        last = residual;
    }
}

// Of the same family, but nothing was fitted to them.
TEST_P(ResidualTwist, other_cases_of_the_family_are_within_ten_degrees) {
    EXPECT_LE(std::abs(residual_error("twist60_j2_yield0.03", Load::twist, 60, 0.03, 6, GetParam())), 10);
    EXPECT_LE(std::abs(residual_error("bend60_j2_yield0.03", Load::bend, 60, 0.03, 6, GetParam())), 10);
}

INSTANTIATE_TEST_SUITE_P(Neighbours, ResidualTwist, ::testing::Values(6, 26), ::testing::PrintToStringParamName());

}  // namespace
}  // namespace sunder
