// Particles and their groups in blocks of eight, so that one instruction works on eight of them.
#pragma once

#include <span>
#include <vector>

#include "solver/data/ids.h"
#include "solver/scene/live_topology.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// Every particle that is bound to another, and the group that it is the centre of, has a lane; lone ones have none.
/// Eight lanes are a block. A group of block b has its members in the block's rows, one a row:
///
///     lane      8b    8b+1  ...  8b+7       neighbour(row, 0 .. 7): the members' lanes, which are as well the groups
///     row 0   member member     member      that the particle of the lane is in; where a group has fewer members than
///     row 1   member member     padding     the block has rows, the lane itself, with a weight of 0
///
/// Within a window of particles, lanes are in the order of ring sizes, so that little is padding. A unit is what is
/// solved by itself: a piece, or several small ones; its rows and neighbours are counted from its first, so that
/// whoever works on it needs memory for it alone. All is a function of the topology alone.
class LaneLayout {
public:
    static constexpr uint32_t kLanes = 8;

    struct Unit {
        uint32_t begin_block, end_block;
        uint32_t begin_row, end_row;

        size_t n_blocks() const { return end_block - begin_block; }
        size_t n_rows() const { return end_row - begin_row; }
    };

    /// Does nothing if the topology is the one of the last call; true if it did something.
    bool update(const LiveTopology& live, const WorkerPool& workers);

    uint64_t version() const { return version_; }  // of the topology
    size_t n_blocks() const { return particle_.size() / kLanes; }
    size_t n_rows() const { return neighbour_.size() / kLanes; }
    std::span<const Unit> units() const { return units_; }
    ParticleId particle(size_t lane) const { return particle_[lane]; }       // none: padding
    uint32_t lane(ParticleIndex particle) const { return lane_[particle]; }  // kNone: a lone particle
    std::span<const ParticleId> particles() const { return particle_; }      // (n_lanes)

    // Of one unit; rows and lanes within it.
    const uint32_t* row_begin(size_t u) const {
        return row_begin_.data() + units_[u].begin_block + u;
    }                                             // (n_blocks + 1)
    const uint32_t* neighbours(size_t u) const {  // (n_rows x 8)
        return neighbour_.data() + size_t{kLanes} * units_[u].begin_row;
    }

private:
    // Blocks of one unit whose particles are sorted together.
    struct Window {
        uint32_t unit, begin_block, end_block;
    };
    void list_units(const LiveTopology& live);
    void sort_window(const LiveTopology& live, const Window& window);
    void list_neighbours(const LiveTopology& live, const Window& window);

    uint64_t version_ = 0;
    std::vector<Unit> units_;
    std::vector<ParticleId> particle_;
    std::vector<uint32_t> lane_, neighbour_;
    std::vector<uint32_t> row_begin_;  // unit after unit, each with its end
    std::vector<Window> windows_;
};

}  // namespace sunder
