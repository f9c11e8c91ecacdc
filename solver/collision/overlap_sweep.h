// Overlapping boxes by sweeping along one axis: sort and prune.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "solver/data/math.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// Boxes in the order of their lower ends along the axis on which they lie farthest apart.
class OverlapSweep {
public:
    /// Takes up the boxes that `is_usable` tells (n_boxes). Returns how many pairs overlap along the axis: each costs
    /// `find` less than a nanosecond, so it pays up to thousands a box. Cheapest where boxes lie as in the last call.
    uint64_t sort(std::span<const Aabb> boxes, std::span<const uint8_t> is_usable, const WorkerPool& workers);

    size_t n_rows() const { return start_.size(); }

    /// Appends the overlapping pairs of the boxes that were sorted (closed: touching counts), either first, in an order
    /// that depends on the boxes alone: of each pair the box that begins first is in rows [begin, end).
    void find(size_t begin, size_t end, std::vector<std::pair<uint32_t, uint32_t>>& out) const;

    /// Writes which of the boxes that were sorted `own` overlaps, in an order that depends on the boxes alone.
    void find_with(const Aabb& own, std::vector<uint32_t>& out) const;

private:
    struct Limits {
        float y_min, y_max, z_min, z_max;
    };
    template <class Hit>
    void test_rows(const Limits& own, size_t begin, size_t end, const Hit& hit) const;

    struct Start {
        double at;
        uint32_t box;
        bool operator<(const Start& o) const { return at < o.at || (at == o.at && box < o.box); }
    };
    void take_up(std::span<const Aabb> boxes, std::span<const uint8_t> is_usable);
    void restore_order();

    int axis_ = 0;
    std::vector<Start> start_;   // ascending
    std::vector<Aabb> box_;      // as start_
    std::vector<uint32_t> end_;  // of each in start_: those from there on begin beyond it
    std::vector<double> reach_;  // the farthest end of those up to each in start_
    std::vector<float>
        across_[4];  // ends on the two other axes, rounded outwards: lower, upper, lower, upper (as start_, padded)
};

}  // namespace sunder
