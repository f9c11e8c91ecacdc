// What interfaces carry besides their triangles.
#pragma once

#include "solver/data/fragment_set.h"

namespace sunder {

/// UVs of the break surfaces: each interface seen along its normal, in metres, origin at its centroid.
/// Needs measured interfaces (measure_fragments).
void assign_interface_uvs(FragmentSet& io_set);

}  // namespace sunder
