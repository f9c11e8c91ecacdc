#include "solver/contacts/find/contact_reach.h"

#include <gtest/gtest.h>

namespace sunder {
namespace {

// What stays apart, and whatever the things it is between touch otherwise, is left out.
TEST(contact_reach, ends_where_nothing_brings_things_together) {
    const double h = 0.01, margin = 1e-3;  // s, m
    std::vector<Contact> contacts(2);
    std::vector<ContactReach> reach(2);
    const MovableId first(0), second(1), third(2);
    contacts[0].a = first, contacts[0].b = second, contacts[1].a = second, contacts[1].b = third;
    const auto second_is_in_reach = [&](double gap, double allowed, double speed_of_first) {
        contacts[1].gap = gap, reach[1].allowed = allowed, reach[0].speed = speed_of_first;
        const std::vector<ContactId> those = in_reach(contacts, reach, 3, h, margin);
        EXPECT_EQ(those.front(), 0u);
        return those.size() == 2;
    };
    EXPECT_TRUE(second_is_in_reach(2e-3, 0, 0));
    EXPECT_FALSE(second_is_in_reach(3e-3, 0, 0));
    EXPECT_FALSE(second_is_in_reach(-2e-3, -5e-3, 0)) << "it may come closer than it is";
    EXPECT_TRUE(second_is_in_reach(8e-3, 0, 1)) << "what hits one of the two may throw it at the other";
    EXPECT_FALSE(second_is_in_reach(8e-3, 0, 0.5));
}

}  // namespace
}  // namespace sunder
