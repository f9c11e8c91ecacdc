#include "solver/threads/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <numeric>
#include <stdexcept>
#include <string>
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

// Shares of any size, some of nobody: whoever is done takes over what others have not begun.
TEST(WorkerPool, does_every_item_of_uneven_shares_once) {
    for (int threads : kThreads) {
        const WorkerPool workers(threads);
        const size_t n = 500, n_shares = static_cast<size_t>(threads);
        const auto all_in = [&](size_t owner) { return [&, owner](size_t share) { return share > owner ? n : 0; }; };
        const auto ever_less = [&](size_t share) { return share == n_shares ? n : n - n / (share + 1); };
        std::vector<int> done(n, 0);
        const auto count = [&](size_t i, size_t slot) {
            EXPECT_LT(slot, n_shares);
            ++done[i];
        };
        for (int job = 0; job < 50; ++job) {
            workers.for_shares(n, all_in(0), count);
            workers.for_shares(n, all_in(n_shares - 1), count);
            workers.for_shares(n, ever_less, count);
        }
        EXPECT_EQ(done, std::vector<int>(n, 150)) << threads << " threads";
    }
}

// Whoever comes begins with its own share, if it is not done by then; items take long enough for others to come.
TEST(WorkerPool, begins_with_the_share_of_its_slot) {
    for (int threads : kThreads) {
        const WorkerPool workers(threads);
        const size_t n_shares = static_cast<size_t>(threads), each = 20;
        std::vector<std::vector<size_t>> order(n_shares);  // by slot
        workers.for_each_in_slots(n_shares * each, [&](size_t i, size_t slot) {
            order[slot].push_back(i / each);
            std::this_thread::sleep_for(std::chrono::microseconds(200));
        });
        for (size_t slot = 0; slot < n_shares; ++slot)  // its own, then those behind it, around
            for (size_t k = 0; k + 1 < order[slot].size(); ++k) {
                const auto turn = [&](size_t share) { return (share + n_shares - slot) % n_shares; };
                EXPECT_LE(turn(order[slot][k]), turn(order[slot][k + 1])) << threads << " threads, slot " << slot;
            }
    }
}

// Number of the item that a job failed at; -1: it did not.
template <class Job>
int failed_at(const Job& job) {
    try {
        job();
    } catch (const std::runtime_error& e) {
        return std::stoi(e.what());
    }
    return -1;
}

// Every worker's part fails in one job and none in the next: nobody is left in a job, none forgets to come.
TEST(WorkerPool, hands_on_the_first_failure_and_stays_usable) {
    for (int threads : kThreads) {
        const WorkerPool workers(threads);
        for (const int first : {0, 1, 37, 63}) {
            const auto fail_from = [&](size_t i) {
                if (static_cast<int>(i) >= first) throw std::runtime_error(std::to_string(i));
            };
            const std::string where = std::to_string(threads) + " threads, from " + std::to_string(first);
            EXPECT_EQ(failed_at([&] {
                          workers.for_range(64, 1, [&](size_t begin, size_t end) {
                              for (size_t i = begin; i < end; ++i) fail_from(i);
                          });
                      }),
                      first)
                << where;
            EXPECT_EQ(failed_at([&] { workers.for_each(64, fail_from); }), first) << where;
            std::vector<int> done(64, 0);
            workers.for_range(64, 1, [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end; ++i) ++done[i];
            });
            workers.for_each(64, [&](size_t i) { ++done[i]; });
            EXPECT_EQ(done, std::vector<int>(64, 2)) << where;
        }
    }
}

// The caller may only leave when no thread is in the body any more, for what the body uses goes with it: a failure of
// the first range waits for the others.
TEST(WorkerPool, leaves_no_thread_behind_in_a_body_that_failed) {
    for (int threads : kThreads) {
        const WorkerPool workers(threads);
        std::atomic<int> inside{0};
        const auto slow = [&](size_t i) {
            ++inside;
            if (i > 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
            --inside;
            if (i == 0) throw std::runtime_error("0");
        };
        for (int job = 0; job < 20; ++job) {
            EXPECT_EQ(failed_at([&] {
                          workers.for_range(static_cast<size_t>(threads), 1,
                                            [&](size_t begin, size_t) { slow(begin); });
                      }),
                      0);
            EXPECT_EQ(inside, 0) << threads << " threads";
            EXPECT_EQ(failed_at([&] { workers.for_each(static_cast<size_t>(threads), slow); }), 0);
            EXPECT_EQ(inside, 0) << threads << " threads";
        }
    }
}

// As in solvers: a failure of one of a few items, whichever thread has it.
TEST(WorkerPool, tells_the_lowest_of_several_failures) {
    for (int threads : kThreads) {
        const WorkerPool workers(threads);
        for (int job = 0; job < 300; ++job)
            EXPECT_EQ(failed_at([&] {
                          workers.for_each(100, [&](size_t i) {
                              if (i == 41 || i == 42 || i == 43 || i == 99) throw std::runtime_error(std::to_string(i));
                          });
                      }),
                      41)
                << threads << " threads";
    }
}

}  // namespace
}  // namespace sunder
