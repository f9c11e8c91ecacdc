// What pins and sources take along, between two frames: the way that the solver had it on.
#pragma once

#include <vector>

#include "nodes/files/scene_time.h"
#include "nodes/graph/node.h"
#include "solver/data/frame_state.h"
#include "solver/scene/scene.h"

namespace sunder {

/// A particle whose motion is given for all of a frame, at a share of it.
struct Carried {
    ParticleId particle;
    Vec3 position = Vec3::Zero(), velocity = Vec3::Zero(), acceleration = Vec3::Zero();  // m, m/s, m/s2

    bool operator==(const Carried&) const = default;
};

/// Of active pins that hold firmly, and of sources that are followed to the frame's end, whose state is `end`; the last
/// one of a particle counts. Needs `share` in [0, 1].
std::vector<Carried> carried_by(const Scene& scene, const FrameInput& input, const FrameState& end, double share);

/// On the way from a grid point to the next, whose state is `end`.
Result<std::vector<Carried>> carried_at(CookContext& context, const Scene& scene, const FrameState& end,
                                        const SceneTime& at);

}  // namespace sunder
