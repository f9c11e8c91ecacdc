// Gas in a hollow body.
#pragma once

#include <span>

#include "solver/scene/local_force.h"

namespace sunder {

/// Of its pressure, what is left of it as a body stands: half, where so much is open as its `vent` says. The opening of
/// a piece is what its share of the lining lacks to be closed, by the vectors of areas; each opening has two sides.
/// Fragments that sleep or stand by (not 0 in `asleep`), or are not in this part of the scene, are taken for pieces of
/// their own.
double pressure_left(const Pressure& gas, const SimulationMesh& rest, const FrameState& state,
                     std::span<const uint8_t> asleep, uint32_t body);

}  // namespace sunder
