// How the deformer asks for threads, without knowing any.
#pragma once

#include <cstddef>
#include <functional>

namespace sunder {

/// Calls body(begin, end) on contiguous ranges that cover [0, n), in any order and perhaps at once; ranges shorter than
/// `grain` are not split off. Whoever writes only what belongs to its range gets the same bits with any.
using RangeRunner = std::function<void(size_t n, size_t grain, const std::function<void(size_t, size_t)>& body)>;

inline void run_serially(size_t n, size_t, const std::function<void(size_t, size_t)>& body) {
    if (n > 0) body(0, n);
}

}  // namespace sunder
