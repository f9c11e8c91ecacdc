#include "fracture_tools/skin/side_by_side.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace sunder {
namespace {

// As a pool of threads runs ranges, whatever it has beside.
RangeRunner on_threads(size_t n_threads) {
    return [n_threads](size_t n, size_t grain, const std::function<void(size_t, size_t)>& body) {
        const size_t parts = std::min(n_threads, n / std::max<size_t>(grain, 1));
        if (parts <= 1) return run_serially(n, grain, body);
        std::vector<std::jthread> threads;
        for (size_t p = 0; p < parts; ++p) threads.emplace_back([&, p] { body(n * p / parts, n * (p + 1) / parts); });
    };
}

class SideBySide : public ::testing::TestWithParam<size_t> {};
INSTANTIATE_TEST_SUITE_P(Threads, SideBySide, ::testing::Values(1, 2, 3, 8), ::testing::PrintToStringParamName());

// Fewer tasks than threads and more; loops that are split and not, one after the other in the same task, of lengths
// that no number of threads divides.
TEST_P(SideBySide, every_task_and_every_entry_of_its_loops_is_done_once) {
    const RangeRunner run = on_threads(GetParam());
    for (const size_t n_tasks : {0, 1, 2, 5, 12})
        for (int round = 0; round < 8; ++round) {
            constexpr size_t kLoops = 40;
            std::vector<std::atomic<int>> calls(n_tasks);
            std::atomic<size_t> wrong{0};
            run_side_by_side(n_tasks, run, [&](size_t task, const RangeRunner& of_task) {
                ++calls[task];
                for (size_t loop = 0; loop < kLoops; ++loop) {
                    const size_t n = loop * (task + 1) % 37, grain = loop % 5;
                    std::vector<int> done(n, 0);
                    of_task(n, grain, [&](size_t begin, size_t end) {
                        if (begin >= end || (end - begin < grain && end - begin != n)) ++wrong;
                        for (size_t i = begin; i < end; ++i) ++done[i];
                    });
                    for (const int d : done) wrong += d != 1;
                    std::atomic<size_t> sum{0};
                    run_by_turns(of_task, n, 3, [&](size_t begin, size_t end) { sum += end - begin; });
                    wrong += sum != n;
                }
            });
            for (const std::atomic<int>& c : calls) EXPECT_EQ(c, 1);
            EXPECT_EQ(wrong, 0u);
        }
}

TEST(SideBySide, nobody_is_woken_where_there_is_nothing_to_do) {
    const RangeRunner run = [](size_t, size_t, const auto&) { ADD_FAILURE(); };
    run_side_by_side(0, run, [](size_t, const RangeRunner&) { ADD_FAILURE(); });
}

TEST(SideBySide, threads_without_a_task_join_the_loops_of_the_one_that_is_left) {
    std::mutex guard;
    std::set<std::thread::id> inside;
    run_side_by_side(2, on_threads(3), [&](size_t task, const RangeRunner& of_task) {
        for (int loop = 0; task == 1 && loop < 5000 && inside.size() < 3; ++loop)
            of_task(3, 1, [&](size_t, size_t) {
                {
                    const std::lock_guard lock(guard);
                    inside.insert(std::this_thread::get_id());
                }
                std::this_thread::sleep_for(std::chrono::microseconds(200));  // whoever comes late finds a part left
            });
    });
    EXPECT_EQ(inside.size(), 3u);
}

// Tasks 2 and 4 fail in a loop that other threads may have joined; whoever waits for them is not left waiting.
TEST_P(SideBySide, a_failure_ends_its_task_alone_and_is_told_at_the_end) {
    for (int round = 0; round < 20; ++round) {
        std::vector<std::atomic<int>> ended(6);
        std::string told;
        try {
            run_side_by_side(6, on_threads(GetParam()), [&](size_t task, const RangeRunner& of_task) {
                of_task(24, 1, [&](size_t begin, size_t end) {
                    if ((task == 2 || task == 4) && begin <= 17 && 17 < end)
                        throw std::runtime_error("task " + std::to_string(task));
                });
                ++ended[task];
            });
        } catch (const std::runtime_error& e) {
            told = e.what();
        }
        EXPECT_EQ(told, "task 2");
        for (size_t task = 0; task < ended.size(); ++task) EXPECT_EQ(ended[task], task == 2 || task == 4 ? 0 : 1);
    }
}

}  // namespace
}  // namespace sunder
