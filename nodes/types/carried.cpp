#include "nodes/types/carried.h"

#include <algorithm>

#include "nodes/types/solver_scene.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

/// Place of a particle at a share of the frame, m.
template <class Place>
Carried carried(ParticleId particle, double share, double duration, Place&& place) {
    constexpr double kStep =
        1e-3;  // of the frame; differences of places of 1 m are right to 1e-9 m/s2 and (kStep w h)^2
    const double middle = std::clamp(share, kStep, 1 - kStep), dt = kStep * duration;
    const Vec3 before = place(middle - kStep), now = place(middle), after = place(middle + kStep);
    const Vec3 acceleration = (after - 2 * now + before) / (dt * dt);
    return {particle, place(share), (after - before) / (2 * dt) + (share - middle) * duration * acceleration,
            acceleration};
}

}  // namespace

std::vector<Carried> carried_by(const Scene& scene, const FrameInput& input, const FrameState& end, double share) {
    std::vector<Carried> all;
    const SimulationMesh& rest = scene.rest;
    for (size_t k = 0; k < scene.sources.size(); ++k) {
        const FrameInput::SourceDrive& drive = input.sources[k];
        for (const ParticleId i : scene.sources[k].particles)
            if (i < end.inactive.size() && end.inactive[i].follows())
                all.push_back(carried(i, share, input.duration, [&](double at) {
                    return SourceWay(*drive.begin, *drive.end, drive.pivot, at)
                        .pose(rest.fragment[i], rest.rest_position[i])
                        .apply(rest.rest_position[i]);
                }));
    }
    for (size_t k = 0; k < scene.pins.size(); ++k)
        if (input.pins[k].active && input.pins[k].grip.is_rigid())
            for (const ParticleId i : scene.pins[k].particles)
                all.push_back(carried(i, share, input.duration, [&](double at) {
                    return pin_pose(scene, input, k, i, at).apply(rest.rest_position[i]);
                }));
    return all;
}

Result<std::vector<Carried>> carried_at(CookContext& context, const Scene& scene, const FrameState& end,
                                        const SceneTime& at) {
    if (scene.pins.empty() && scene.sources.empty()) return std::vector<Carried>();
    const Result<FrameInput> input = frame_input(context, at.grid() + 1);
    if (!input) return input.error();
    return carried_by(scene, *input, end, at.share());
}

}  // namespace sunder
