// The outermost points of fragments.
#pragma once

#include "solver/data/fragment_set.h"
#include "solver/data/simulation_mesh.h"

namespace sunder {

/// Fills the hulls of `io_mesh`, whose particles are the fragments of `set`: of each fragment's vertices those that lie
/// farthest along some of 128 directions. A box keeps its corners; of a ball's support at most 3 % are lost.
void find_hulls(const FragmentSet& set, SimulationMesh& io_mesh);

}  // namespace sunder
