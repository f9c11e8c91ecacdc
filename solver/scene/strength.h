// What it takes to break a fragment off.
#pragma once

#include <span>
#include <vector>

#include "solver/scene/scene.h"

namespace sunder {

/// Of each particle, the least tensile strain at which its group may part an edge that is still intact, -; kNever where
/// it has none, or glued ones alone. `materials`: one a body, as of the frame.
std::vector<double> fragment_toughness(const SimulationMesh& rest, std::span<const Material> materials,
                                       std::span<const uint8_t> edge_intact, std::span<const double> bonds = {});

/// What edges are stronger or weaker by in a frame, for seams (of each its factor, FrameInput::seams) for what is
/// glued, and for what a source carries along, which bears nothing; empty: all 1. (n_edges), -
std::vector<double> edge_bonds(const Scene& scene, std::span<const double> seams, const FrameState& state);

}  // namespace sunder
