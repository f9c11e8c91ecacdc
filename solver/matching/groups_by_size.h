// Groups of a size put together, for kernels that take four at a time.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace sunder {

/// Groups collected until there are four of one size, so that they have as many members side by side.
class GroupsBySize {
public:
    /// Calls four(groups, n) whenever there are four (n = 4).
    template <class Four>
    void add(uint32_t group, uint32_t size, const Four& four) {
        take(group, waiting_[std::min<size_t>(size, waiting_.size() - 1)], four);
    }
    /// The rest, whatever their sizes; where there are n < 4, the others repeat the first.
    template <class Four>
    void finish(const Four& four) {
        Waiting rest;
        for (Waiting& w : waiting_) {
            for (uint32_t i = 0; i < w.n; ++i) take(w.group[i], rest, four);
            w.n = 0;
        }
        if (rest.n == 0) return;
        for (uint32_t i = rest.n; i < 4; ++i) rest.group[i] = rest.group[0];
        four(rest.group, rest.n);
    }

private:
    struct Waiting {
        uint32_t n = 0, group[4];
    };
    template <class Four>
    static void take(uint32_t group, Waiting& io_waiting, const Four& four) {
        io_waiting.group[io_waiting.n++] = group;
        if (io_waiting.n < 4) return;
        io_waiting.n = 0;
        four(io_waiting.group, 4u);
    }
    std::array<Waiting, 32> waiting_;  // by size; the last holds all larger ones
};

}  // namespace sunder
