// How fast simulated time runs: what frames of the output show of it.
#pragma once

#include "nodes/files/scene_time.h"
#include "nodes/graph/description.h"

namespace sunder {

/// "time_scale" of a solver. Its keys are in frames of the output.
ParameterDescription time_scale_parameter();

/// "accelerations" of a solver: whether meshes tell them.
ParameterDescription accelerations_parameter();

/// Simulated time after `passed` simulated frames, the integral of the scale from the start on. What is within a
/// millionth of a frame of a grid point is on it, for sums of keys are rounded.
SceneTime scene_time(int start, double passed, double scale);

}  // namespace sunder
