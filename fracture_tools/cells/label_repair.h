// Clusters of cells made fit to be fragments: in one piece each, and as manifold as relabelling gets them.
#pragma once

#include <cstdint>
#include <vector>

#include "fracture_tools/cells/cell_complex.h"

namespace sunder {

struct LabelRepair {
    uint32_t n_labels = 0;     // afterwards; each has at least one cell
    size_t pinched_edges = 0;  // edges left along which a fragment only touches itself
};

/// Relabels single cells so that each label's cells hang together by faces and no label touches itself along an edge.
/// Gives `wanted` labels, 0 .. wanted - 1, unless there are fewer cells, or more separate parts of the solid than that.
/// Labels keep their order. Points where a label touches itself are left (fragment_mesh() parts them).
LabelRepair repair_labels(const CellComplex& complex, uint32_t wanted, std::vector<uint32_t>& io_label);

}  // namespace sunder
