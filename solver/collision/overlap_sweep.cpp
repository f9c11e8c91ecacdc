#include "solver/collision/overlap_sweep.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <functional>

#include "solver/collision/broad_phase.h"

namespace sunder {
namespace {

// To the nearest float, less or more by two roundings: monotone, so that what overlaps does so in floats.
float outwards(double x, float direction) {
    const float f = static_cast<float>(std::clamp(x, -3e38, 3e38));
    return f + direction * (std::abs(f) * 2.4e-7f + 1e-37f);
}

constexpr size_t kTogether = 8;  // boxes that are tested side by side

// A bit for each of eight boxes that is not beside the limits.
template <class Limits>
uint32_t hits_of(const Limits& own, const float* y_min, const float* y_max, const float* z_min, const float* z_max) {
    using Four = float __attribute__((vector_size(16)));
    using Answers = int __attribute__((vector_size(16)));
    constexpr Answers kBits[2] = {{1, 2, 4, 8}, {16, 32, 64, 128}};
    const auto four = [](const float* from) {
        Four v;
        std::memcpy(&v, from, sizeof(v));
        return v;
    };
    Answers hits = {};
    for (int k = 0; k < 2; ++k)
        hits |= (four(y_min + 4 * k) <= own.y_max) & (four(y_max + 4 * k) >= own.y_min) &
                (four(z_min + 4 * k) <= own.z_max) & (four(z_max + 4 * k) >= own.z_min) & kBits[k];
    uint64_t two[2];
    std::memcpy(two, &hits, sizeof(two));
    const uint64_t bits = two[0] | two[1];
    return static_cast<uint32_t>(bits | bits >> 32);
}

// Where four fifths of the boxes lie farthest apart, judged by some of them: runaways do not count.
int widest_axis(std::span<const Aabb> boxes, std::span<const uint8_t> is_usable) {
    constexpr size_t kSample = 64;
    const size_t stride = boxes.size() / kSample + 1;
    double widest = -1, x[kSample];
    int best = 0;
    for (int axis = 0; axis < 3; ++axis) {
        size_t n = 0;
        for (size_t i = 0; i < boxes.size(); i += stride)
            if (is_usable[i]) x[n++] = boxes[i].min[axis];
        std::sort(x, x + n);
        const double width = n > 0 ? x[n - 1 - n / 10] - x[n / 10] : 0;
        if (width > widest) widest = width, best = axis;
    }
    return best;
}

}  // namespace

// In the order of the last time, if the boxes are the same: what moves little is nearly sorted.
void OverlapSweep::take_up(std::span<const Aabb> boxes, std::span<const uint8_t> is_usable) {
    const auto n_usable = static_cast<size_t>(std::ranges::count(is_usable, uint8_t{1}));
    const auto is_there = [&](const Start& s) { return s.box < boxes.size() && is_usable[s.box]; };
    if (start_.size() == n_usable && std::ranges::all_of(start_, is_there)) {
        for (Start& s : start_) s.at = boxes[s.box].min[axis_];
        return;
    }
    start_.clear();
    for (uint32_t i = 0; i < boxes.size(); ++i)
        if (is_usable[i]) start_.push_back({boxes[i].min[axis_], i});
}

void OverlapSweep::restore_order() {
    size_t moves = 8 * start_.size();  // beyond it sorting anew is cheaper
    for (size_t k = 1; k < start_.size(); ++k) {
        const Start own = start_[k];
        size_t to = k;
        while (to > 0 && own < start_[to - 1] && moves > 0) start_[to] = start_[to - 1], --to, --moves;
        start_[to] = own;
        if (moves == 0) {
            std::ranges::sort(start_, std::less<>());
            return;
        }
    }
}

uint64_t OverlapSweep::sort(std::span<const Aabb> boxes, std::span<const uint8_t> is_usable,
                            const WorkerPool& workers) {
    constexpr size_t kGrain = 256;
    axis_ = widest_axis(boxes, is_usable);
    take_up(boxes, is_usable);
    restore_order();
    const size_t n = start_.size();
    box_.resize(n), end_.resize(n);
    for (std::vector<float>& side : across_) side.assign(n + kTogether, 3e38f);
    workers.for_range(n, kGrain, [&](size_t first, size_t last) {
        for (size_t k = first; k < last; ++k) {
            const Aabb& box = box_[k] = boxes[start_[k].box];
            for (int side = 0; side < 4; ++side) {
                const int axis = (axis_ + 1 + side / 2) % 3;
                across_[side][k] = side % 2 == 0 ? outwards(box.min[axis], -1) : outwards(box.max[axis], 1);
            }
            const auto after = std::upper_bound(start_.begin() + static_cast<std::ptrdiff_t>(k), start_.end(),
                                                box.max[axis_], [](double end, const Start& s) { return end < s.at; });
            end_[k] = static_cast<uint32_t>(after - start_.begin());
        }
    });
    uint64_t n_tests = 0;
    reach_.resize(n);
    for (size_t k = 0; k < n; ++k) {
        n_tests += end_[k] - k;
        reach_[k] = k == 0 ? box_[k].max[axis_] : std::max(reach_[k - 1], box_[k].max[axis_]);
    }
    return n_tests;
}

// Calls hit(k) for rows [begin, end) that are not beside the limits.
template <class Hit>
void OverlapSweep::test_rows(const Limits& own, size_t begin, size_t end, const Hit& hit) const {
    const float *const y_min = across_[0].data(), *const y_max = across_[1].data(), *const z_min = across_[2].data(),
                       *const z_max = across_[3].data();
    for (size_t j = begin; j < end; j += kTogether) {
        uint32_t hits = hits_of(own, y_min + j, y_max + j, z_min + j, z_max + j);
        if (end - j < kTogether) hits &= (1u << (end - j)) - 1;
        for (; hits != 0; hits &= hits - 1) hit(j + static_cast<size_t>(std::countr_zero(hits)));
    }
}

void OverlapSweep::find(size_t begin, size_t end, std::vector<std::pair<uint32_t, uint32_t>>& out) const {
    const Start* const start = start_.data();
    const Aabb* const box = box_.data();
    for (size_t k = begin; k < end; ++k)
        test_rows({across_[0][k], across_[1][k], across_[2][k], across_[3][k]}, k + 1, end_[k], [&](size_t m) {
            if (overlap(box[k], box[m])) out.push_back({start[k].box, start[m].box});
        });
}

void OverlapSweep::find_with(const Aabb& own, std::vector<uint32_t>& out) const {
    out.clear();
    const int y = (axis_ + 1) % 3, z = (axis_ + 2) % 3;
    const Limits limits = {outwards(own.min[y], -1), outwards(own.max[y], 1), outwards(own.min[z], -1),
                           outwards(own.max[z], 1)};
    const auto beyond = std::upper_bound(start_.begin(), start_.end(), own.max[axis_],
                                         [](double end, const Start& s) { return end < s.at; });
    const auto first = std::ranges::lower_bound(reach_, own.min[axis_]);
    test_rows(limits, static_cast<size_t>(first - reach_.begin()), static_cast<size_t>(beyond - start_.begin()),
              [&](size_t m) {
                  if (overlap(own, box_[m])) out.push_back(start_[m].box);
              });
}

}  // namespace sunder
