// How the deformer asks for threads, without knowing any.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>

namespace sunder {

/// Calls body(begin, end) on contiguous ranges that cover [0, n), in any order and perhaps at once; ranges shorter than
/// `grain` are not split off. Whoever writes only what belongs to its range gets the same bits with any.
using RangeRunner = std::function<void(size_t n, size_t grain, const std::function<void(size_t, size_t)>& body)>;

inline void run_serially(size_t n, size_t, const std::function<void(size_t, size_t)>& body) {
    if (n > 0) body(0, n);
}

/// Calls body(begin, end) for ranges of `grain` that cover [0, n), each by whichever thread is free: for work that
/// costs more in one place than in another, and for threads that are not alone on their processor.
template <class Body>
void run_by_turns(const RangeRunner& run, size_t n, size_t grain, const Body& body) {
    std::atomic<size_t> next{0};
    run((n + grain - 1) / grain, 1, [&](size_t, size_t) {
        for (size_t begin; (begin = next.fetch_add(grain, std::memory_order_relaxed)) < n;)
            body(begin, std::min(n, begin + grain));
    });
}

}  // namespace sunder
