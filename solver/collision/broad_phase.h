// Which movable things may touch: pairs of overlapping boxes.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "solver/collision/overlap_sweep.h"
#include "solver/data/ids.h"
#include "solver/data/math.h"

namespace sunder {

using Pair = std::pair<uint32_t, uint32_t>;

/// One-rings as they stand. Ring of particle i: slots [begin[i], end[i]) of `member`, ascending (the centre itself may
/// be among them). Where `edge` is given, a slot counts only while edge_intact[edge[slot]] is not 0.
struct LiveRings {
    std::span<const uint32_t> begin, end;  // (n_particles); empty: nothing is joined
    std::span<const ParticleId> member;
    std::span<const EdgeId> edge;          // as member, or empty: every slot is intact
    std::span<const uint8_t> edge_intact;  // (n_edges), with `edge`

    bool joined(ParticleIndex i, ParticleIndex j) const;

    /// Joined, or both joined to a third: shape matching keeps such two apart, and their ellipsoids, which overlap at
    /// rest, would only jam a body that is squeezed.
    bool near(ParticleIndex i, ParticleIndex j) const;

    /// Writes i to io_mark[j - first] of all j that are near it; `first`: no particle joined to any of them is below.
    void mark_near(ParticleId i, std::span<uint32_t> io_mark, uint32_t first = 0) const;
};

/// Pairs that never touch, however near they are.
struct PairFilter {
    uint32_t n_particles = 0;        // items below it are particles, the others rigid bodies
    std::span<const uint32_t> body;  // (n_particles), or empty: all are of one body
    bool self_collision = true;      // particles of one body against one another
    LiveRings rings;
    std::span<const uint32_t> item = {};  // (n_items), or empty: items of one number never touch

    bool excludes(uint32_t i, uint32_t j) const;

    /// Takes out what is excluded; fastest where pairs with the same first one follow one another. `io_marks` tells of
    /// whom each particle was last found near: empty, or as a call with the same rings left it.
    void remove_excluded(std::vector<uint32_t>& io_marks, std::vector<Pair>& io_pairs) const;

    bool same_body(uint32_t i, uint32_t j) const;
    bool is_possible(uint32_t i, uint32_t j) const;  // but for the rings
    bool excludes_by_rings_alone() const { return item.empty() && self_collision; }
};

/// Reusable memory of find_overlaps.
struct OverlapScratch {
    struct Entry {
        uint64_t key;
        uint32_t item;
        uint32_t visitor;
    };
    std::vector<uint8_t> usable;
    OverlapSweep sweep;
    std::vector<double> extents;
    std::vector<uint8_t> level;
    std::vector<Entry> entries, sorted;
    std::vector<uint32_t> bucket_begin;
    std::vector<uint32_t> near;  // of PairFilter::remove_excluded
    std::vector<std::vector<Pair>> chunks;
};

/// All pairs of overlapping boxes (closed: touching counts) that `filter` does not exclude, each once, either first, in
/// an order that depends on the boxes alone. Boxes that are not finite or empty touch nothing.
///
/// Swept along the axis on which the boxes lie farthest apart where that leaves few pairs to test, as it does up to
/// tens of thousands of boxes that fill a scene; else in a grid.
void find_overlaps(std::span<const Aabb> boxes, const PairFilter& filter, const WorkerPool& workers,
                   OverlapScratch& scratch, std::vector<Pair>& out);

/// The same, all of them, by a hierarchical grid (Mirtich 1997, Ericson 2005, 7.2.1): a box rests in the level whose
/// cells are just larger than it, in the eight cells it covers at most, and visits those of the coarser levels that
/// hold anything; so a boulder among grains costs its visitors, not the square of the grains. The cell of the finest
/// level is set by the median extent. A pair is reported by the cell that holds the lower corner of the boxes'
/// intersection: once. Expected time O(n * levels + pairs); boxes that all overlap give all pairs.
void find_in_grid(std::span<const Aabb> boxes, OverlapScratch& scratch, std::vector<Pair>& out);

/// Boxes that share a point.
inline bool overlap(const Aabb& a, const Aabb& b) {
    return (a.min.array() <= b.max.array()).all() && (b.min.array() <= a.max.array()).all();
}

/// Finite and not empty.
bool is_usable(const Aabb& box);

/// False where either is not a number.
inline bool holds(const Aabb& outer, const Aabb& inner) {
    return (outer.min.array() <= inner.min.array()).all() && (inner.max.array() <= outer.max.array()).all();
}

}  // namespace sunder
