// Disjoint sets of indices, numbered by their lowest member whatever order they were united in.
#pragma once

#include <cstdint>
#include <numeric>
#include <vector>

namespace sunder {

/// Each of n indices alone in its set. A member leads to a lower one of its set, the lowest to itself.
inline std::vector<uint32_t> disjoint_sets(size_t n) {
    std::vector<uint32_t> sets(n);
    std::iota(sets.begin(), sets.end(), 0u);
    return sets;
}

/// The lowest member of i's set; shortens the path to it.
inline uint32_t lowest(std::vector<uint32_t>& io_sets, uint32_t i) {
    while (io_sets[i] != i) i = io_sets[i] = io_sets[io_sets[i]];
    return i;
}

inline void unite(std::vector<uint32_t>& io_sets, uint32_t i, uint32_t j) {
    if (io_sets[i] == io_sets[j]) return;  // most often, where there are many ways from one to another
    i = lowest(io_sets, i), j = lowest(io_sets, j);
    if (i < j)
        io_sets[j] = i;
    else
        io_sets[i] = j;
}

}  // namespace sunder
