// What a part of a scene may touch soon.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/broad_phase.h"
#include "solver/data/frame_state.h"
#include "solver/scene/step_context.h"

namespace sunder {

/// Boxes that hold each movable that does not rest for so many seconds from its present state, and whatever its
/// contacts reach, by a share `skin` of its radius more; `end`: where pins are then, of the frame. Empty for what
/// rests.
std::vector<Aabb> reach(const StepContext& context, const FrameState& state, std::span<const uint8_t> rests,
                        double seconds, double end, double skin);

}  // namespace sunder
