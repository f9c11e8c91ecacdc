// What the triangles of a visual mesh and their corners are: the artist's outside, where they are on the cut within.
#pragma once

#include <memory>

#include "fracture_tools/mesh/range_runner.h"
#include "fracture_tools/skin/shared_array.h"
#include "fracture_tools/skin/split_topology.h"
#include "fracture_tools/skin/visual_mesh.h"

namespace sunder {

/// Lists them frame after frame. Those of the outer surface come first in every frame and never change: they are
/// written once into each array.
class VisualAttributes {
public:
    explicit VisualAttributes(std::shared_ptr<const FragmentSet> set) : set_(std::move(set)) {}

    /// Fills triangle_* (but for triangle_hidden), corner_uvs, corner_colors and corner_rim of `io_mesh`.
    void list(const SplitTopology& topology, const RangeRunner& run, VisualMesh& io_mesh);

private:
    std::shared_ptr<const FragmentSet> set_;
    ArrayRecycler<int32_t> material_, interface_;
    ArrayRecycler<uint32_t> fragment_;
    ArrayRecycler<Vec2f> uvs_;
    ArrayRecycler<Color> colors_;
    ArrayRecycler<float> rim_;
};

}  // namespace sunder
