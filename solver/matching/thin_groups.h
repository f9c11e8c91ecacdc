// Which groups bend by their curvature: those one fragment thick, as in sheets and rods, and those a few fragments
// thick, of bodies that do.
#pragma once

#include <span>
#include <vector>

#include "solver/data/thin_fragments.h"
#include "solver/scene/scene.h"

namespace sunder {

/// kThin or kSlender where a group bends by its curvature, else 0: it is one of a block.
uint8_t bending_kind(const SimulationMesh& rest, std::span<const Material> materials, ParticleIndex g);
/// Whether any does.
bool bends(const SimulationMesh& rest, std::span<const Material> materials);
/// Gives a state that was made without them what such groups change for good, unbent.
void add_bending(const SimulationMesh& rest, std::span<const Material> materials, FrameState& io_state);

}  // namespace sunder
