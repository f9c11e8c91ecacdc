#include "solver/collision/overlap_sweep.h"

#include <algorithm>
#include <cstring>

#include "solver/collision/broad_phase.h"

namespace sunder {
namespace {

// To the nearest float, less or more by two roundings: monotone, so that what overlaps does so in floats.
float outwards(double x, float direction) {
    const float f = static_cast<float>(std::clamp(x, -3e38, 3e38));
    return f + direction * (std::abs(f) * 2.4e-7f + 1e-37f);
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

uint64_t OverlapSweep::sort(std::span<const Aabb> boxes, std::span<const uint8_t> is_usable) {
    axis_ = widest_axis(boxes, is_usable);
    start_.clear();
    for (uint32_t i = 0; i < boxes.size(); ++i)
        if (is_usable[i]) start_.push_back({boxes[i].min[axis_], i});
    std::ranges::sort(start_, {}, [](const Start& s) { return std::pair(s.at, s.box); });
    const size_t n = start_.size();
    end_.resize(n);
    uint64_t n_tests = 0;
    for (size_t k = 0; k < n; ++k) {
        const auto after =
            std::upper_bound(start_.begin() + static_cast<std::ptrdiff_t>(k), start_.end(),
                             boxes[start_[k].box].max[axis_], [](double end, const Start& s) { return end < s.at; });
        end_[k] = static_cast<uint32_t>(after - start_.begin());
        n_tests += end_[k] - k;
    }
    return n_tests;
}

void OverlapSweep::find(std::span<const Aabb> boxes, std::vector<std::pair<uint32_t, uint32_t>>& out) {
    constexpr size_t kWord = 8;  // answers that are looked at together
    const size_t n = start_.size();
    for (int side = 0; side < 4; ++side) {
        const int axis = (axis_ + 1 + side / 2) % 3;
        across_[side].resize(n);
        for (size_t k = 0; k < n; ++k) {
            const Aabb& box = boxes[start_[k].box];
            across_[side][k] = side % 2 == 0 ? outwards(box.min[axis], -1) : outwards(box.max[axis], 1);
        }
    }
    hit_.resize(n + kWord);
    uint8_t* const hit = hit_.data();
    const float *const y_min = across_[0].data(), *const y_max = across_[1].data(), *const z_min = across_[2].data(),
                       *const z_max = across_[3].data();
    for (size_t k = 0; k < n; ++k) {
        const size_t first = k + 1, count = end_[k] > first ? end_[k] - first : 0;
        const float own_y_min = y_min[k], own_y_max = y_max[k], own_z_min = z_min[k], own_z_max = z_max[k];
        for (size_t j = 0; j < count; ++j)
            hit[j] = (y_min[first + j] <= own_y_max) & (y_max[first + j] >= own_y_min) &
                     (z_min[first + j] <= own_z_max) & (z_max[first + j] >= own_z_min);
        std::memset(hit + count, 0, kWord);
        for (size_t j = 0; j < count; j += kWord) {
            uint64_t word;
            std::memcpy(&word, hit + j, kWord);
            if (word == 0) continue;
            for (size_t m = j; m < j + kWord; ++m) {
                if (!hit[m]) continue;
                const uint32_t a = start_[k].box, b = start_[first + m].box;
                if (overlap(boxes[a], boxes[b])) out.push_back({a, b});
            }
        }
    }
}

}  // namespace sunder
