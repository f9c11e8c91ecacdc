// Which groups bend by their curvature: those one fragment thick, as in sheets and rods, of bodies that do.
#pragma once

#include <span>
#include <vector>

#include "solver/data/thin_fragments.h"
#include "solver/scene/scene.h"

namespace sunder {

/// Whether a group is thin and its body bends by its curvature.
bool bends(const SimulationMesh& rest, std::span<const Material> materials, ParticleIndex g);
/// Whether any is.
bool bends(const SimulationMesh& rest, std::span<const Material> materials);
/// Gives a state that was made without them what such groups change for good, unbent.
void add_bending(const SimulationMesh& rest, std::span<const Material> materials, FrameState& io_state);

}  // namespace sunder
