// Which corners of the visual mesh have one normal, as its vertices split.
#pragma once

#include <span>
#include <vector>

#include "fracture_tools/mesh/range_runner.h"
#include "fracture_tools/skin/split_topology.h"
#include "solver/data/ids.h"

namespace sunder {

/// Corners of one fan that share a normal at rest are a part. Listed parts of one visual vertex whose corners share it
/// hang together: they are led by the lowest, and have one normal, which goes by the number of that part for as long as
/// nothing breaks there.
///
/// Of the faces from `first_face` on, which share none with those before them. Corners are counted from there.
class NormalParts {
public:
    /// `smooth`: lowest corner that a corner shares its normal with, as long as nothing breaks
    /// (3 (n_faces - first_face)).
    NormalParts(const SplitTopology& topology, uint32_t first_face, std::span<const uint32_t> smooth);

    /// Joins parts anew around the pool vertices that the topology's last update changed, and lists the normals of
    /// visual vertices. A function of the topology alone; to be called once after each update that changed something.
    void update(const SplitTopology& topology, const RangeRunner& run);

    size_t n_normals() const { return leader_.size(); }
    std::span<const uint32_t> leader() const { return leader_; }         // part              (n_normals), ascending
    std::span<const uint32_t> visual_vertex() const { return vertex_; }  // (n_normals)
    /// The leader of the part of a corner, where its face is listed. (n_corners)
    std::span<const uint32_t> corner_leader() const { return corner_leader_; }

    size_t n_parts() const { return part_fan_.size(); }
    /// The listed part after this one that hangs together with it, kNone after the last. (n_parts)
    std::span<const uint32_t> next() const { return next_; }
    /// Corners of a part are corners()[offset()[part]] and those behind, ascending. (n_parts + 1)
    std::span<const uint32_t> offset() const { return part_offset_; }
    std::span<const uint32_t> corners() const { return part_corner_; }

private:
    void join_around(uint32_t pool_vertex, const SplitTopology& topology);

    uint32_t first_face_;
    std::vector<uint32_t> corner_leader_;              // (n_corners)
    std::vector<uint32_t> part_fan_;                   // ascending                           (n_parts)
    std::vector<uint32_t> part_smooth_;                // entry of `smooth` of its corners    (n_parts)
    std::vector<uint32_t> part_offset_, part_corner_;  // corners of a part                   (n_parts + 1)
    std::vector<uint32_t> vertex_part_;                // first part of a pool vertex         (n_vertices + 1)
    std::vector<uint32_t> corner_part_;                // (n_corners)
    std::vector<uint32_t> part_listed_;                // how many corners are of listed faces (n_parts)
    std::vector<uint32_t> led_by_;           // lowest that it hangs together with, kNone: not listed (n_parts)
    std::vector<uint32_t> next_;             // kNone: the last                     (n_parts)
    std::vector<uint8_t> leads_;             // 1: it leads itself                  (n_parts)
    std::vector<uint32_t> leader_, vertex_;  // (n_normals)
};

}  // namespace sunder
