// Which cells of space hold something.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/collision/broad_phase.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// It may say yes where it should say no.
class CellFilter {
public:
    /// Of the boxes of those that `counts`.
    CellFilter(std::span<const Aabb> boxes, std::span<const uint8_t> counts, const WorkerPool& workers);

    bool may_meet(const Aabb& box) const;

private:
    bool covers_many(const Aabb& box) const;
    template <class Visit>
    void for_cells(const Aabb& box, const Visit& visit) const;

    double inverse_ = 0;  // of a cell's size, 1/m
    std::vector<std::atomic<uint64_t>> bits_;
    std::vector<Aabb> large_;
};

}  // namespace sunder
