// What a solver node makes of its inputs: the scene at the first frame, and what moves it at each.
#pragma once

#include "nodes/graph/node.h"
#include "solver/scene/scene.h"

namespace sunder {

/// A scene and the key of all that went into it.
struct SceneInput {
    Scene scene;
    std::vector<ContentKey> body_keys;  // BodyValue::key of each body
    ContentKey key = 0;
    std::vector<std::string> warnings;                         // of what keeps fragments
    std::vector<std::shared_ptr<const VertexMotion>> motions;  // of each body, or null
};

/// From the inputs at the first frame. Errors: no body; a pin whose body is not wired to the solver.
Result<SceneInput> scene_input(CookContext& context);

/// Settings of the whole simulation, from the solver node's parameters.
SolverSettings settings_of(const Parameters& parameters);

/// What drives the step from `frame` - 1 to `frame`. Materials, gravity and forces are those of `frame`; poses run from
/// one frame's to the other's.
Result<FrameInput> frame_input(CookContext& context, int frame);

/// Sentences on blasts that never go off, for they are to before the first frame.
Result<std::vector<std::string>> missed_blasts(CookContext& context);

/// Of all that decides a step but the state it starts from.
ContentKey key_of(const FrameInput& input, const SolverSettings& settings);
ContentKey key_of(const std::vector<Material>& materials);

}  // namespace sunder
