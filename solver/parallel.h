// Fork and join over ranges. Threads write only their own range, so results do not depend on how many there are.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>

#include "solver/data/first_failure.h"

namespace sunder {

/// What a body throws is thrown again on the calling thread, when all threads have left the body: of several that which
/// comes first by index, the same for any number of threads. Ranges behind may have been done or not. The pool stays
/// usable.
class WorkerPool {
public:
    /// `threads` >= 1, the calling thread included; 0: all cores.
    explicit WorkerPool(int threads);
    ~WorkerPool();

    int threads() const;

    /// Calls body(begin, end) on contiguous ranges that cover [0, n), the first on the calling thread. Ranges shorter
    /// than `grain` are not split off: a join costs half a microsecond, and a thread fetches what another wrote before.
    /// Ranges whose thread has not come by then, the calling one does when it is done with its own.
    template <class Body>
    void for_range(size_t n, size_t grain, const Body& body) const {
        run(
            n, grain, [](const void* b, size_t begin, size_t end) { (*static_cast<const Body*>(b))(begin, end); },
            &body);
    }

    /// Calls body(i, slot) for i in [0, n), each once, by whichever thread is free; its slot, below threads(), is no
    /// other thread's while the call lasts.
    template <class Body>
    void for_each_in_slots(size_t n, const Body& body) const {
        std::atomic<size_t> next{0};
        FirstFailure failure;
        for_range(std::min<size_t>(n, static_cast<size_t>(threads())), 1, [&](size_t slot, size_t) {
            for (size_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < n;) {
                try {
                    body(i, slot);
                } catch (...) {  // all lower ones have been begun
                    failure.take(i);
                    next.store(n, std::memory_order_relaxed);
                }
            }
        });
        failure.rethrow();
    }

    /// The same without slots.
    template <class Body>
    void for_each(size_t n, const Body& body) const {
        for_each_in_slots(n, [&](size_t i, size_t) { body(i); });
    }

private:
    using Call = void (*)(const void* body, size_t begin, size_t end);
    void run(size_t n, size_t grain, Call call, const void* body) const;

    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace sunder
