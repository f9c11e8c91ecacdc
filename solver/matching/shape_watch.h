// What changed of the rest shapes of a unit since they were last looked at.
#pragma once

#include <span>
#include <vector>

#include "solver/matching/group_shape.h"
#include "solver/matching/unit_schedule.h"

namespace sunder {

class ShapeWatch {
public:
    /// From now on this unit, as it stands; true if all of it is new.
    bool look(const GroupShapes& shapes, const LaneLayout& layout, size_t unit, const UnitBlocks& blocks);

    /// A shape of the last look's unit changed before it.
    bool is_any_changed() const { return is_any_changed_; }
    bool is_changed(size_t lane) const { return changed_[lane] != 0; }
    /// One of the block's groups changed, or one that a particle of the block is in.
    bool are_rows_changed(size_t block) const;

    const LaneLayout& layout() const { return *layout_; }
    const LaneLayout::Unit& unit() const { return layout_->units()[unit_]; }
    const uint32_t* row_begin() const { return layout_->row_begin(unit_); }
    const uint32_t* neighbours() const { return layout_->neighbours(unit_); }
    std::span<const ParticleId> particles() const {  // of its lanes
        return layout_->particles().subspan(first_lane(), n_lanes());
    }
    size_t n_lanes() const { return size_t{LaneLayout::kLanes} * unit().n_blocks(); }

private:
    size_t first_lane() const { return size_t{LaneLayout::kLanes} * unit().begin_block; }

    const LaneLayout* layout_ = nullptr;
    uint64_t version_ = 0;  // of the layout
    size_t unit_ = 0;
    bool is_any_changed_ = false;
    std::vector<uint64_t> revision_;  // of each group's shape at the last look (by lane)
    std::vector<uint8_t> changed_;    // (by lane)
};

}  // namespace sunder
