#include "solver/collision/cell_filter.h"

#include <bit>
#include <cmath>

#include "solver/data/invariant.h"
#include "solver/matching/unit_schedule.h"

namespace sunder {

template <class Visit>
void CellFilter::for_cells(const Aabb& box, const Visit& visit) const {
    const auto cell = [&](double x) { return static_cast<int64_t>(std::floor(x * inverse_)); };
    for (int64_t x = cell(box.min.x()); x <= cell(box.max.x()); ++x)
        for (int64_t y = cell(box.min.y()); y <= cell(box.max.y()); ++y)
            for (int64_t z = cell(box.min.z()); z <= cell(box.max.z()); ++z) {
                uint64_t k = uint64_t(x) * 0x9e3779b97f4a7c15u + uint64_t(y) * 0xc2b2ae3d27d4eb4fu +
                             uint64_t(z) * 0x165667b19e3779f9u;
                k = (k ^ k >> 32) * 0xd6e8feb86659fd93u;
                visit((k ^ k >> 32) & (64 * bits_.size() - 1));
            }
}

CellFilter::CellFilter(std::span<const Aabb> boxes, std::span<const uint8_t> counts, const WorkerPool& workers) {
    SUNDER_ASSERT(counts.size() == boxes.size());
    double extent = 0;
    size_t n_boxes = 0;
    for (size_t i = 0; i < boxes.size(); ++i)
        if (counts[i]) extent += (boxes[i].max - boxes[i].min).maxCoeff(), ++n_boxes;
    inverse_ = 1 / std::max(extent / static_cast<double>(std::max<size_t>(n_boxes, 1)), 1e-6);
    bits_ = std::vector<std::atomic<uint64_t>>(std::bit_ceil(64 * n_boxes + 1024) / 64);
    for (size_t i = 0; i < boxes.size(); ++i)
        if (counts[i] && covers_many(boxes[i])) large_.push_back(boxes[i]);
    const auto mark = [&](uint64_t bit) {  // in any order
        std::atomic<uint64_t>& word = bits_[bit / 64];
        const uint64_t mask = uint64_t{1} << bit % 64;
        if (!(word.load(std::memory_order_relaxed) & mask)) word.fetch_or(mask, std::memory_order_relaxed);
    };
    workers.for_range(boxes.size(), kParticleGrain, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i)
            if (counts[i] && !covers_many(boxes[i])) for_cells(boxes[i], mark);
    });
}

bool CellFilter::may_meet(const Aabb& box) const {
    for (const Aabb& other : large_)
        if (overlap(box, other)) return true;
    if (covers_many(box)) return true;
    bool meets = false;
    for_cells(box, [&](uint64_t bit) { meets |= bits_[bit / 64] >> bit % 64 & 1; });
    return meets;
}

bool CellFilter::covers_many(const Aabb& box) const {
    const Vec3 cells = (box.max - box.min) * inverse_ + Vec3::Ones();
    return !(cells.prod() < 512) || !(box.min.cwiseAbs().maxCoeff() * inverse_ < 1e9);
}

}  // namespace sunder
