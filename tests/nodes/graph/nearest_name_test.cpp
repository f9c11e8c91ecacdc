#include "nodes/graph/nearest_name.h"

#include <gtest/gtest.h>

namespace sunder {
namespace {

TEST(NearestName, finds_a_slip_of_the_finger) {
    EXPECT_EQ(nearest_name("denisty", {"friction", "density", "depth"}), "density");
    EXPECT_EQ(nearest_name("toughnes", {"toughness", "compressive_toughness"}), "toughness");
}

TEST(NearestName, offers_nothing_that_is_not_like_it) {
    EXPECT_EQ(nearest_name("zzz", {"density", "friction"}), "");
    EXPECT_EQ(nearest_name("", {"density"}), "");
    EXPECT_EQ(nearest_name("density", {}), "");
    EXPECT_EQ(nearest_name(std::string(100000, 'x'), {"density"}), "");
}

TEST(NearestName, takes_the_first_of_equals) { EXPECT_EQ(nearest_name("bax", {"bar", "baz"}), "bar"); }

TEST(NearestName, cuts_long_lists_short) {
    const std::string text = permitted_text("q", std::vector<std::string>(50, "name"));
    EXPECT_NE(text.find("and 30 more"), std::string::npos) << text;
}

}  // namespace
}  // namespace sunder
