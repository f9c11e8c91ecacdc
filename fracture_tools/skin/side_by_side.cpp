#include "fracture_tools/skin/side_by_side.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include "solver/data/first_failure.h"

namespace sunder {
namespace {

constexpr size_t kMostThreads = 256;

// Loops follow each other within microseconds: look a while before sleeping.
template <class T>
void wait_for_change(const std::atomic<T>& value, T seen) {
    for (int look = 0; look < 2000; ++look) {
        if (value.load(std::memory_order_acquire) != seen) return;
        if (look >= 100) std::this_thread::yield();
    }
    value.wait(seen, std::memory_order_acquire);
}

// The loop that a task is in, whose parts are done by whichever thread takes them.
class alignas(64) SharedLoop {
public:
    using Body = std::function<void(size_t, size_t)>;

    // Opens a loop; the last one has ended. `parts`: at most kMostThreads.
    void open(const Body& body, size_t n, size_t parts) {
        body_ = &body, n_ = n;
        left_.store(static_cast<uint32_t>(parts), std::memory_order_relaxed);
        const uint64_t number = (next_.load(std::memory_order_relaxed) >> 32) + 1;
        next_.store(number << 32 | parts << 16, std::memory_order_release);
    }

    // Does a part that nobody has taken; false: there is none. Whoever has taken one may read the loop until it is
    // done.
    bool help() {
        uint64_t next = next_.load(std::memory_order_acquire), part, parts;
        do {
            part = next & 0xffff, parts = next >> 16 & 0xffff;
            if (part >= parts) return false;
        } while (!next_.compare_exchange_weak(next, next + 1, std::memory_order_acq_rel, std::memory_order_acquire));
        try {
            (*body_)(n_ * part / parts, n_ * (part + 1) / parts);
        } catch (...) {
            failure_.take(part);
        }
        if (left_.fetch_sub(1) == 1) left_.notify_one();  // in sequence with a look at who sleeps
        return true;
    }

    // Waits until all parts are done; throws what the first of them threw.
    void finish() {
        for (uint32_t left; (left = left_.load(std::memory_order_acquire)) > 0;) wait_for_change(left_, left);
        failure_.rethrow();
    }

private:
    std::atomic<uint64_t> next_{0};  // number of the loop, 32 bits; its parts, 16; the next of them to take, 16
    std::atomic<uint32_t> left_{0};  // parts that are not done
    const Body* body_ = nullptr;
    size_t n_ = 0;
    FirstFailure failure_;
};

}  // namespace

void run_side_by_side(size_t n, const RangeRunner& run,
                      const std::function<void(size_t i, const RangeRunner& run)>& task) {
    if (n == 0) return;
    if (n == 1) return task(0, run);
    std::vector<SharedLoop> loops(std::min(n, kMostThreads));  // of the threads that have had a task
    std::vector<std::atomic<bool>> begun(n);
    std::atomic<size_t> n_loops{0}, n_threads{0};
    std::atomic<size_t> left{n};    // tasks
    std::atomic<uint32_t> news{0};  // grows when a loop opens and when the last task ends
    FirstFailure failure;

    const auto tell = [&] {
        news.fetch_add(1);
        news.notify_all();
    };
    run(kMostThreads, 1, [&](size_t place, size_t) {  // once for each thread
        n_threads.fetch_add(1, std::memory_order_relaxed);
        SharedLoop* loop = nullptr;
        const RangeRunner own = [&](size_t length, size_t grain, const SharedLoop::Body& body) {
            const size_t parts =
                std::min(n_threads.load(std::memory_order_relaxed), length / std::max<size_t>(grain, 1));
            if (parts <= 1) {
                if (length > 0) body(0, length);
                return;
            }
            loop->open(body, length, parts);
            tell();
            while (loop->help()) {
            }
            loop->finish();
        };
        for (size_t k = 0; k < n; ++k) {
            const size_t i = (n * place / kMostThreads + k) % n;
            if (begun[i].exchange(true, std::memory_order_relaxed)) continue;
            if (!loop) loop = &loops[n_loops.fetch_add(1, std::memory_order_relaxed)];
            try {
                task(i, own);
            } catch (...) {
                failure.take(i);
            }
            if (left.fetch_sub(1) == 1) tell();
        }
        for (;;) {
            const uint32_t seen = news.load(std::memory_order_acquire);
            if (left.load(std::memory_order_acquire) == 0) return;
            bool helped = false;
            for (SharedLoop& other : loops) helped |= other.help();
            if (!helped) wait_for_change(news, seen);
        }
    });
    failure.rethrow();
}

}  // namespace sunder
