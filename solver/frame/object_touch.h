// Which fragments a moving shape comes over.
#pragma once

#include "solver/scene/scene.h"

namespace sunder {

/// Whether a shape touches the fragment where it is in the state, anywhere on its way through the frame: its hull where
/// it is known, else its ellipsoid. The shape's places are no farther apart than a quarter of the fragment's least
/// radius. `beyond`: so near is a touch, m.
bool comes_over(const Shape& shape, const DrivenPose& way, const SimulationMesh& rest, const FrameState& state,
                ParticleId particle, double beyond = 0);

}  // namespace sunder
