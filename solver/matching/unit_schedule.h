// Which thread works on which unit of LaneLayout, or which piece.
#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "solver/matching/lane_layout.h"
#include "solver/threads/parallel.h"

namespace sunder {

constexpr size_t kGroupGrain = 256, kParticleGrain = 256;  // fewest a thread is worth waking for
constexpr size_t kSharedUnit = 64;                         // blocks; the fewest that all threads work on together

/// Blocks [0, n) of one unit, by all threads or by one.
class UnitBlocks {
public:
    static constexpr size_t kGrain = 32;  // fewest blocks that a thread is worth waking for

    UnitBlocks(size_t n, const WorkerPool* sharing) : n_(n), sharing_(sharing) {}

    template <class Body>
    void operator()(const Body& body) const {
        if (sharing_)
            sharing_->for_range(n_, kGrain, body);
        else
            body(size_t{0}, n_);
    }

private:
    size_t n_;
    const WorkerPool* sharing_;  // null: the calling thread alone
};

/// Calls body(unit, slot, blocks) for every unit. Those of `least_shared` blocks and more are worked on by all threads
/// together, one after the other, if they are so large a part of the scene that the others would not keep the threads
/// busy; the rest each by one thread. slot < threads: no other unit has it meanwhile.
template <class Body>
void for_units(const LaneLayout& layout, size_t least_shared, const WorkerPool& workers, const Body& body) {
    const auto units = layout.units();
    least_shared = std::max(least_shared, layout.n_blocks() / (2 * static_cast<size_t>(workers.threads())));
    std::vector<uint32_t> apart;
    for (uint32_t u = 0; u < units.size(); ++u) {
        if (units[u].n_blocks() < least_shared)
            apart.push_back(u);
        else
            body(u, size_t{0}, UnitBlocks(units[u].n_blocks(), &workers));
    }
    const size_t n_shares = static_cast<size_t>(workers.threads());
    std::vector<size_t> first(n_shares + 1, apart.size());
    for (size_t share = 0; share < n_shares; ++share) {  // by blocks, which ascend as particles do
        const auto begins_before = [&](uint32_t u) {
            return units[u].begin_block * n_shares < layout.n_blocks() * share;
        };
        first[share] = static_cast<size_t>(std::ranges::partition_point(apart, begins_before) - apart.begin());
    }
    // Largest first, so that threads end together.
    if (n_shares > 1)
        for (size_t share = 0; share < n_shares; ++share)
            std::ranges::stable_sort(apart.begin() + static_cast<std::ptrdiff_t>(first[share]),
                                     apart.begin() + static_cast<std::ptrdiff_t>(first[share + 1]), std::greater{},
                                     [&](uint32_t u) { return units[u].n_blocks(); });
    workers.for_shares(
        apart.size(), [&](size_t share) { return first[share]; },
        [&](size_t i, size_t slot) { body(apart[i], slot, UnitBlocks(units[apart[i]].n_blocks(), nullptr)); });
}

/// Calls body(begin_piece, end_piece) on ranges that cover all pieces, of about as many particles each and `grain` at
/// least.
template <class Body>
void for_piece_ranges(const LiveTopology& live, size_t grain, const WorkerPool& workers, const Body& body) {
    workers.for_range(live.pieces().size(), grain, [&](size_t begin, size_t end) {
        const size_t first = live.piece_from(begin), last = live.piece_from(end);
        if (first < last) body(first, last);
    });
}

/// Calls body(piece) for each.
template <class Body>
void for_pieces(const LiveTopology& live, size_t grain, const WorkerPool& workers, const Body& body) {
    for_piece_ranges(live, grain, workers, [&](size_t first, size_t last) {
        for (size_t piece = first; piece < last; ++piece) body(piece);
    });
}

}  // namespace sunder
