#include "solver/data/invariant.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "solver/data/result.h"
#include "solver/scene/ring_check.h"
#include "solver/threads/parallel.h"
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

// In every build; what failed, and where, without the folder that was built in.
TEST(assertion, that_does_not_hold_is_thrown_and_says_which) {
    const int one = 1;
    EXPECT_NO_THROW(SUNDER_ASSERT(one == 1));
    try {
        SUNDER_ASSERT(one == 2 && "text, with a comma");
        FAIL() << "not thrown";
    } catch (const std::logic_error& e) {
        const std::string text = e.what();
        EXPECT_NE(text.find("it does not hold that one == 2"), std::string::npos) << text;
        EXPECT_NE(text.find("(tests/solver/data/invariant_test.cpp:"), std::string::npos) << text;
    }
}

// Whichever thread meets it: the caller hears of it, and the pool goes on.
TEST(assertion, in_a_worker_thread_ends_at_the_caller) {
    const WorkerPool workers(3);
    const auto told = [&](size_t broken) -> std::string {
        try {
            workers.for_range(300, 1,
                              [&](size_t begin, size_t end) { SUNDER_ASSERT(broken < begin || broken >= end); });
        } catch (const std::logic_error& e) {
            return e.what();
        }
        return "";
    };
    for (const size_t part : {0, 150, 299}) EXPECT_NE(told(part).find("broken < begin"), std::string::npos) << part;
    EXPECT_EQ(told(300), "");
}

// What enters rooms with numbers of another scene is told, and not read beyond its end.
TEST(assertion, guards_the_doors_of_rooms) {
    const SimulationMesh rest = test::lattice_mesh({{2, 2, 2}, 0.1, 6, 1000, {}});
    LiveTopology live;
    EXPECT_THROW(live.reset(rest, std::vector<uint8_t>(rest.n_edges() - 1, 1)), std::logic_error);
    live.reset(rest, std::vector<uint8_t>(rest.n_edges(), 1));
    EXPECT_THROW(live.remove_edges(rest, std::vector{EdgeId(rest.n_edges())}), std::logic_error);
    const Result<int> error = bad_usage("nothing");
    EXPECT_THROW(*error, std::logic_error);
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
    live.remove_edges(rest, std::vector<EdgeId>{EdgeId(7)});
    EXPECT_TRUE(rings_match_edges(live, rest, intact));
    intact[7] = 1;
    EXPECT_FALSE(rings_match_edges(live, rest, intact));
}

}  // namespace
}  // namespace sunder
