#include "solver/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <thread>
#include <vector>

namespace sunder {
namespace {

constexpr int kThreads[] = {1, 2, 3, 8};

TEST(WorkerPool, does_every_index_once_whatever_the_threads_and_the_grain) {
    for (int threads : kThreads) {
        const WorkerPool workers(threads);
        EXPECT_EQ(workers.threads(), threads);
        for (size_t n : {0, 1, 2, 7, 100})
            for (size_t grain : {0, 1, 3, 50, 1000}) {
                std::vector<int> ranges(n, 0), each(n, 0);
                workers.for_range(n, grain, [&](size_t begin, size_t end) {
                    EXPECT_GE(end - begin, std::min(n, std::max<size_t>(grain, 1)));
                    for (size_t i = begin; i < end; ++i) ++ranges[i];
                });
                workers.for_each(n, [&](size_t i) { ++each[i]; });
                EXPECT_EQ(ranges, std::vector<int>(n, 1)) << threads << " threads, grain " << grain;
                EXPECT_EQ(each, std::vector<int>(n, 1)) << threads << " threads";
            }
    }
}

// One job after the other, with workers awake, asleep, and too many for the cores: what a job wrote, the next one sees.
TEST(WorkerPool, neither_loses_nor_repeats_a_part_when_workers_come_late) {
    for (int threads : kThreads) {
        const WorkerPool workers(threads);
        std::vector<int> sums(64, 0), before = sums;
        for (int job = 0; job < 3000; ++job) {
            if (job % 1000 == 999) std::this_thread::sleep_for(std::chrono::milliseconds(5));
            workers.for_range(sums.size(), 1, [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end; ++i) sums[i] = before[(i + 1) % before.size()] + 1;
            });
            std::swap(sums, before);
        }
        EXPECT_EQ(before, std::vector<int>(64, 3000)) << threads << " threads";
    }
}

// A slot belongs to one thread at a time: what is counted in it without locks is whole.
TEST(WorkerPool, keeps_slots_apart) {
    for (int threads : kThreads) {
        const WorkerPool workers(threads);
        std::vector<size_t> counts(static_cast<size_t>(threads), 0);
        workers.for_each_in_slots(10000, [&](size_t, size_t slot) { ++counts[slot]; });
        EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), size_t{0}), 10000u) << threads << " threads";
    }
}

}  // namespace
}  // namespace sunder
