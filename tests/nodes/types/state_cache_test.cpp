#include "nodes/types/state_cache.h"

#include <gtest/gtest.h>

namespace sunder {
namespace {

StateCache::Entry entry(int frame) {
    auto state = std::make_shared<FrameState>();
    state->yield.assign(1000, frame);
    return {static_cast<ContentKey>(frame), state, {}};
}

TEST(StateCache, keeps_every_frame_within_its_bound) {
    StateCache cache;
    for (int f = 1; f <= 50; ++f) cache.put(f, entry(f), 1u << 20);
    EXPECT_EQ(cache.size(), 50u);
    for (int f = 1; f <= 50; ++f) EXPECT_EQ(cache.at(f)->history, static_cast<ContentKey>(f));
}

TEST(StateCache, stays_within_its_bound_with_frames_spread_over_the_shot) {
    StateCache cache;
    const size_t one = memory_of(*entry(0).state), limit = 20 * one;
    for (int f = 1; f <= 1000; ++f) {
        cache.put(f, entry(f), limit);
        EXPECT_LE(cache.bytes(), limit);
        EXPECT_TRUE(cache.at(f)) << "the newest has to stay, the next frame starts from it";
        EXPECT_TRUE(cache.at(1));
    }
    int longest = 0;
    for (int f = 1; f <= 1000; ++f) {
        int kept = 0;
        ASSERT_TRUE(cache.latest(f, kept));
        longest = std::max(longest, f - kept);
    }
    EXPECT_LE(longest, 128);  // a stride of 64 would not fit 20 times into 1000... 64 * 20 > 1000: at most twice that
    EXPECT_GE(cache.size(), 8u);
}

TEST(StateCache, one_state_larger_than_the_bound_is_kept_all_the_same) {
    StateCache cache;
    for (int f = 1; f <= 5; ++f) cache.put(f, entry(f), 10);
    EXPECT_TRUE(cache.at(5));
    EXPECT_TRUE(cache.at(1));
    EXPECT_LE(cache.size(), 2u);
}

TEST(StateCache, bytes_are_what_the_kept_states_take) {
    StateCache cache;
    cache.put(3, entry(3), 1u << 20);
    cache.put(3, entry(4), 1u << 20);  // replaced
    EXPECT_EQ(cache.size(), 1u);
    EXPECT_EQ(cache.bytes(), memory_of(*entry(4).state));
    cache.erase(3);
    EXPECT_EQ(cache.bytes(), 0u);
    int frame;
    EXPECT_FALSE(cache.latest(100, frame));
}

TEST(StateCache, going_back_under_the_bound_keeps_working) {
    StateCache cache;
    const size_t limit = 6 * memory_of(*entry(0).state);
    for (int f = 1; f <= 100; ++f) cache.put(f, entry(f), limit);
    int kept = 0;
    ASSERT_TRUE(cache.latest(50, kept));
    for (int f = kept + 1; f <= 50; ++f) {
        ASSERT_TRUE(cache.at(f - 1));
        cache.put(f, entry(f), limit);
    }
    EXPECT_TRUE(cache.at(50));
    EXPECT_LE(cache.bytes(), limit);
}

TEST(StateCache, what_is_given_outlives_what_is_made_of_it_under_the_bound) {
    StateCache cache;
    const size_t limit = 4 * memory_of(*entry(0).state);
    for (int f = 1; f <= 6; ++f) cache.put(f, entry(f), limit);
    cache.give(7, entry(700), limit);
    for (int f = 8; f <= 100; ++f) {
        cache.put(f, entry(f), limit);
        ASSERT_TRUE(cache.at(7)) << f;
        ASSERT_TRUE(cache.at(f));
        ASSERT_LE(cache.bytes(), limit);
    }
    EXPECT_EQ(cache.at(7)->history, ContentKey{700});
}

TEST(StateCache, what_is_given_forgets_what_was_made_after_it_but_nothing_that_was_given) {
    StateCache cache;
    for (int f = 1; f <= 5; ++f) cache.put(f, entry(f), 1u << 20);
    cache.give(6, entry(600), 1u << 20);
    for (int f = 7; f <= 9; ++f) cache.put(f, entry(f), 1u << 20);
    cache.give(3, entry(300), 1u << 20);
    EXPECT_EQ(cache.at(3)->history, ContentKey{300});
    for (const int f : {1, 2, 6, 7, 8, 9}) EXPECT_TRUE(cache.at(f)) << f;
    for (const int f : {4, 5}) EXPECT_FALSE(cache.at(f)) << f;
}

TEST(StateCache, of_what_is_given_the_last_stays_however_small_the_bound) {
    StateCache cache;
    const size_t one = memory_of(*entry(0).state);
    for (int f = 100; f > 0; --f) cache.give(f, entry(f), 10 * one);
    EXPECT_LE(cache.bytes(), 10 * one);
    for (int f = 1; f <= 10; ++f) EXPECT_TRUE(cache.at(f)) << f;
    cache.give(5, entry(500), 10);
    EXPECT_EQ(cache.at(5)->history, ContentKey{500});
    EXPECT_EQ(cache.size(), 1u);
}

}  // namespace
}  // namespace sunder
