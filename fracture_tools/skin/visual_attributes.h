// What the triangles of a visual mesh and their corners are: the artist's outside, where they are on the cut within.
#pragma once

#include <memory>

#include "fracture_tools/mesh/range_runner.h"
#include "fracture_tools/skin/shared_array.h"
#include "fracture_tools/skin/split_topology.h"
#include "fracture_tools/skin/visual_mesh.h"
#include "solver/data/ids.h"

namespace sunder {

/// Lists them frame after frame. Those of the outer surface come first in every frame and never change: they are
/// written once into each array.
class VisualAttributes {
public:
    explicit VisualAttributes(std::shared_ptr<const FragmentSet> set);

    /// Fills triangle_* (but for triangle_hidden), corner_uvs, corner_colors, corner_rim and the layers of `io_mesh`
    /// that are not by point.
    void list(const SplitTopology& topology, const RangeRunner& run, VisualMesh& io_mesh);

    /// Fills the layers by point, after the others. `io_mesh` has its skin.
    void list_points(VisualMesh& io_mesh);

private:
    std::shared_ptr<const FragmentSet> set_;
    ArrayRecycler<int32_t> material_, interface_;
    ArrayRecycler<uint32_t> fragment_;
    ArrayRecycler<Vec2f> uvs_;
    ArrayRecycler<Color> colors_;
    ArrayRecycler<float> rim_;
    std::vector<ArrayRecycler<float>> layers_;  // of each of the set's
    std::vector<uint32_t> outer_corner_;  // of a pool vertex, the first; kNone within; empty if no layer is by point
};

}  // namespace sunder
