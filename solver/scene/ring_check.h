// Whether groups as they stand are what the rest edges less those that broke make of them: for invariant.h.
#pragma once

#include "solver/scene/live_topology.h"

namespace sunder {

/// The rings hold what intact edges join, both ways, and in the same piece.
bool rings_match_edges(const LiveTopology& live, const SimulationMesh& rest, std::span<const uint8_t> edge_intact);

}  // namespace sunder
