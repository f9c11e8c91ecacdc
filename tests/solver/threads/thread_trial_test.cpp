#include "solver/threads/thread_trial.h"

#include <gtest/gtest.h>

namespace sunder {
namespace {

// Frames on the calling thread alone among n that take so long, s, with all threads and alone.
int frames_alone(ThreadTrial& io_trial, int n, double all, double alone) {
    int count = 0;
    for (int k = 0; k < n; ++k) {
        const bool is_alone = io_trial.alone();
        count += is_alone;
        io_trial.took(is_alone ? alone : all);
    }
    return count;
}

TEST(thread_trial, all_threads_are_the_rule) {
    ThreadTrial trial;
    EXPECT_FALSE(trial.alone());
    const int tried = frames_alone(trial, 500, 1.0e-3, 1.6e-3);
    // Two frames of a trial, one to compare, 48 in between.
    EXPECT_GE(tried, 2 * (500 / 51)) << "a machine may have changed its mind";
    EXPECT_LE(tried, 2 * (1 + 500 / 51));
}

TEST(thread_trial, what_loses_by_threads_goes_on_without_them) {
    ThreadTrial trial;
    frames_alone(trial, 10, 1.8e-3, 1.4e-3);  // from the first trial on
    EXPECT_GE(frames_alone(trial, 480, 1.8e-3, 1.4e-3), 480 - 2 * (1 + 480 / 51)) << "but for those of trials";
    EXPECT_LE(frames_alone(trial, 480, 0.9e-3, 1.4e-3), 51 + 2 * 480 / 51) << "back with the next trial";
}

TEST(thread_trial, what_makes_no_difference_stays_as_it_is) {
    ThreadTrial trial;
    EXPECT_LE(frames_alone(trial, 500, 1.0e-3, 1.0e-3), 2 * (1 + 500 / 18)) << "one in 19 frames is compared";
}

// A hiccup of the machine within any one frame does not decide.
TEST(thread_trial, one_slow_frame_decides_nothing) {
    for (int slow = 0; slow < 40; ++slow) {
        ThreadTrial trial;
        frames_alone(trial, slow, 1.0e-3, 1.2e-3);
        trial.took(3.0e-3);
        frames_alone(trial, 8, 1.0e-3, 1.2e-3);  // to the end of a trial
        EXPECT_LE(frames_alone(trial, 15, 1.0e-3, 1.2e-3), 2) << slow;
    }
}

TEST(thread_trial, long_frames_are_not_tried) {
    ThreadTrial trial;
    EXPECT_EQ(frames_alone(trial, 500, 5.0e-3, 4.5e-3), 0) << "one would be seen";
    frames_alone(trial, 40, 3.0e-3, 2.0e-3);
    EXPECT_TRUE(trial.alone());
    EXPECT_LE(frames_alone(trial, 500, 5.0e-3, 9.0e-3), 1) << "a scene that has grown";
}

}  // namespace
}  // namespace sunder
