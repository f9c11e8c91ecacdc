// What pushed an edge that breaks.
#pragma once

#include <span>

#include "solver/contacts/solve/contact_response.h"
#include "solver/scene/live_topology.h"

namespace sunder {

/// Tells the edges that are about to be cut (BrokenEdge::by) what presses hardest on their piece as it still is: the
/// other side of the contact with the largest normal impulse, the first of equals. None where nothing presses on it.
/// Costs nothing where nothing is cut.
void name_pushers(const SimulationMesh& rest, const LiveTopology& live, std::span<const ActiveContact> contacts,
                  std::span<BrokenEdge> io_cuts);

}  // namespace sunder
