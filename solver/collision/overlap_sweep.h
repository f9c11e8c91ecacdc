// Overlapping boxes by sweeping along one axis: sort and prune.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "solver/data/math.h"

namespace sunder {

/// Boxes in the order of their lower ends along the axis on which they lie farthest apart.
class OverlapSweep {
public:
    /// Takes up the boxes that `is_usable` tells (n_boxes). Returns how many pairs overlap along the axis: each costs
    /// `find` less than a nanosecond, so it pays up to thousands a box.
    uint64_t sort(std::span<const Aabb> boxes, std::span<const uint8_t> is_usable);

    /// All overlapping pairs of the boxes that were sorted (closed: touching counts), in no order, either first.
    void find(std::span<const Aabb> boxes, std::vector<std::pair<uint32_t, uint32_t>>& out);

private:
    struct Start {
        double at;
        uint32_t box;
    };
    int axis_ = 0;
    std::vector<Start> start_;   // ascending
    std::vector<uint32_t> end_;  // of each in start_: those from there on begin beyond it
    std::vector<float>
        across_[4];  // ends on the two other axes, rounded outwards: lower, upper, lower, upper (as start_)
    std::vector<uint8_t> hit_;
};

}  // namespace sunder
