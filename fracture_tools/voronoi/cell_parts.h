// Cells that are not in one piece become several.
#pragma once

#include "fracture_tools/cells/cell_complex.h"

namespace sunder {

/// A convex cell meets a solid in any number of parts. Each becomes a cell of its own, numbered in the order of the
/// cells that they come from; hollows stay with the part around them. Cells without faces go. Measures the cells.
/// Volumes of parts that rounding has made flat may be 0 or below: merge_small_cells takes care of them.
void split_into_parts(CellComplex& io_complex);

/// Labels cells 0 .. n - 1 so that cells of less than `least_share` of their neighbours' volume (mean by shared area)
/// have the label of the neighbour that they share most area with, the smallest first. Neighbours and not the mean of
/// all: around an impact all pieces are small, and crumbs are left where a cell only grazes the solid. Labels ascend
/// with their lowest cell. Gives n.
uint32_t merge_small_cells(const CellComplex& complex, double least_share, std::vector<uint32_t>& out_label);

}  // namespace sunder
