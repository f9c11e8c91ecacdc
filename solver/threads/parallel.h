// Fork and join over ranges. Threads write only their own range, so results do not depend on how many there are.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

#include "solver/data/first_failure.h"
#include "solver/data/invariant.h"

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

    /// Calls body(i, slot) for i in [0, n), each once; its slot, below threads(), is no other thread's while the call
    /// lasts. A slot begins with a share of its own, [first(slot), first(slot + 1)), where `first` ascends from 0 to n:
    /// so a thread finds in its caches what it wrote of the same things before. When it is done with that, it takes
    /// over what others have not begun.
    template <class First, class Body>
    void for_shares(size_t n, const First& first, const Body& body) const {
        struct alignas(64) Share {
            std::atomic<size_t> next;
        };
        SUNDER_ASSERT(first(0) == 0 && first(static_cast<size_t>(threads())) == n);
        const size_t n_shares = static_cast<size_t>(threads());
        std::vector<Share> shares(n_shares);
        for (size_t s = 0; s < n_shares; ++s) shares[s].next.store(first(s), std::memory_order_relaxed);
        std::atomic<size_t> lowest{n};  // that failed; all before it are begun
        FirstFailure failure;
        const auto work_on = [&](Share& share, size_t last, size_t slot) {
            for (size_t i; (i = share.next.fetch_add(1, std::memory_order_relaxed)) < last;) {
                size_t failed = lowest.load(std::memory_order_relaxed);
                if (i > failed) return;
                try {
                    body(i, slot);
                } catch (...) {
                    failure.take(i);
                    while (i < failed && !lowest.compare_exchange_weak(failed, i, std::memory_order_relaxed)) {
                    }
                }
            }
        };
        for_range(std::min(n, n_shares), 1, [&](size_t begin, size_t end) {
            for (size_t slot = begin; slot < end; ++slot)
                for (size_t k = slot; k < slot + n_shares; ++k)
                    work_on(shares[k % n_shares], first(k % n_shares + 1), slot);
        });
        failure.rethrow();
    }

    /// The same with even shares.
    template <class Body>
    void for_each_in_slots(size_t n, const Body& body) const {
        const size_t n_shares = static_cast<size_t>(threads());
        for_shares(
            n, [&](size_t share) { return n * share / n_shares; }, body);
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
