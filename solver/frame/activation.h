// What activations and seams do at the start of a frame.
#pragma once

#include "solver/scene/scene.h"

namespace sunder {

/// To be called where a state may be of a scene without activations: all that they name is kept, and stands.
void add_inactivity(const Scene& scene, FrameState& io_state);

/// Pieces of a first state that are asleep throughout need not be simulated from its first frame on.
void put_to_sleep(const Scene& scene, FrameState& io_state);

/// Lets go of what the frame, an object that comes over it, or a break in the frame before (`before`) lets go, cuts
/// seams whose frame it is, and takes up what else cannot break. Wakes what was let go or cut. Whether it cut anything.
bool begin_activations(const Scene& scene, const FrameInput& input, const FrameState& before, FrameState& io_state);

}  // namespace sunder
