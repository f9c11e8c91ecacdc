#include "solver/data/invariant.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "solver/scene/ring_check.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// Run by ctest, all of these tests are.
TEST(invariant, is_checked_where_the_environment_says_so) {
    const char* const set = std::getenv("SUNDER_VALIDATE");
    EXPECT_EQ(checks_invariants(), set && std::string(set) == "1");
}

TEST(invariant, that_does_not_hold_ends_the_program_and_says_which) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    const auto broken = [] {
        setenv("SUNDER_VALIDATE", "1", 1);
        invariant("one is two", [] { return false; });
    };
    EXPECT_DEATH(broken(), "sunder: bug: it does not hold that one is two");
}

// A ring that lost a member that an intact edge joins, or kept one whose edge broke.
TEST(invariant, rings_that_do_not_match_edges_are_found) {
    const SimulationMesh rest = test::lattice_mesh({{3, 3, 3}, 0.1, 6, 1000, {}});
    std::vector<uint8_t> intact(rest.n_edges(), 1);
    LiveTopology live;
    live.reset(rest, intact);
    EXPECT_TRUE(rings_match_edges(live, rest, intact));
    intact[7] = 0;
    EXPECT_FALSE(rings_match_edges(live, rest, intact));
    live.remove_edges(rest, std::vector<uint32_t>{7});
    EXPECT_TRUE(rings_match_edges(live, rest, intact));
    intact[7] = 1;
    EXPECT_FALSE(rings_match_edges(live, rest, intact));
}

}  // namespace
}  // namespace sunder
