#include "solver/matching/shape_watch.h"

#include <algorithm>
#include <atomic>

namespace sunder {

bool ShapeWatch::look(const GroupShapes& shapes, const LaneLayout& layout, size_t unit, const UnitBlocks& blocks) {
    const bool anew = layout_ != &layout || version_ != layout.version() || unit_ != unit;
    layout_ = &layout, version_ = layout.version(), unit_ = unit;
    changed_.resize(n_lanes());
    if (anew) revision_.assign(n_lanes(), 0);  // no shape has it
    std::atomic<bool> any{false};
    blocks([&](size_t begin, size_t end) {
        bool any_here = false;
        for (size_t lane = LaneLayout::kLanes * begin; lane < LaneLayout::kLanes * end; ++lane) {
            const uint32_t g = particles()[lane];
            const uint64_t now = g == kNone ? 0 : shapes.revision[g];
            changed_[lane] = revision_[lane] != now;
            any_here |= changed_[lane] != 0;
            revision_[lane] = now;
        }
        if (any_here) any = true;
    });
    is_any_changed_ = any;
    return anew;
}

bool ShapeWatch::are_rows_changed(size_t block) const {
    constexpr size_t kLanes = LaneLayout::kLanes;
    const uint32_t* const first = neighbours() + kLanes * row_begin()[block];  // the centres are among them
    const uint32_t* const last = neighbours() + kLanes * row_begin()[block + 1];
    return std::any_of(first, last, [&](uint32_t lane) { return changed_[lane] != 0; });
}

}  // namespace sunder
