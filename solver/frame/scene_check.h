// Whether a scene, its input for a frame and its state are sound: what is wrong, and where.
#pragma once

#include "solver/data/frame_state.h"
#include "solver/data/result.h"
#include "solver/scene/scene.h"
#include "solver/threads/parallel.h"

namespace sunder {

Status check_scene(const Scene& scene);
Status check_input(const Scene& scene, const FrameInput& input);
Status check_state(const Scene& scene, const FrameState& state, const WorkerPool& workers);

}  // namespace sunder
