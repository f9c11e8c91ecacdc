// Gas in a hollow body.
#pragma once

#include <span>
#include <vector>

#include "solver/scene/local_force.h"

namespace sunder {

/// As a body stands.
struct Gas {
    double left = 1;           // of its pressure
    std::vector<Vec3> beyond;  // of the turned lining of a fragment, what does not press, m2; or empty: nothing
};

/// Of the pressure half is left where so much is open as its `vent` says. The opening of a piece is what its share of
/// the lining lacks to be closed, by the vectors of areas; each opening has two sides. A closed shell of which no edge
/// is broken is closed however it is bent, and is neither pushed nor turned: what its fragments' turns leave over of
/// force and torque is taken off, by their areas. Fragments that sleep or stand by (not 0 in `asleep`), or are not in
/// this part of the scene, are taken for pieces of their own.
Gas gas_in(const Pressure& gas, const SimulationMesh& rest, const FrameState& state, std::span<const uint8_t> asleep,
           uint32_t body);

}  // namespace sunder
