#include "solver/sleep/awake_reach.h"

#include <algorithm>
#include <cmath>

#include "solver/collision/movable_size.h"
#include "solver/data/invariant.h"
#include "solver/matching/unit_schedule.h"
#include "solver/scene/local_fields.h"
#include "solver/scene/motion.h"
#include "solver/scene/scales.h"
#include "solver/step/following.h"

namespace sunder {

std::vector<Aabb> reach(const StepContext& context, const FrameState& state, std::span<const uint8_t> rests,
                        double seconds, double end, double skin) {
    const size_t n = state.n_particles();
    SUNDER_ASSERT(rests.size() == n + state.rigid_bodies.size() && seconds > 0 && skin >= 0);
    const double fall = fall_in_step(seconds, acceleration_of(context.input));
    const LocalFields local(context.scene, context.input, state, rests);
    const double begin = std::max(0.0, end - seconds / context.input.duration);
    std::vector<Aabb> boxes(rests.size());
    std::vector<double> size(rests.size());
    const auto find = [&](size_t i) {
        const bool is_particle = i < n;
        const RigidBodyState* rigid = is_particle ? nullptr : &state.rigid_bodies[i - n];
        const Vec3& x = is_particle ? state.position[i] : rigid->position;
        const Vec3 way = seconds * (is_particle ? state.velocity[i] : rigid->velocity);
        const double angle = seconds * (is_particle ? state.angular_velocity[i] : rigid->angular_velocity).norm();
        const double radius = reach_of(context.scene, i);
        size[i] = radius * (1 + skin + std::min(angle, 1.0)) + context.contact_margin + fall + skin * way.norm();
        if (!local.empty())
            size[i] +=
                fall_in_step(seconds, local.on({i, x, Quat::Identity(), seconds, begin, end}).acceleration.norm());
        boxes[i] = ball(x, size[i]);
        boxes[i].min += way.cwiseMin(0.0), boxes[i].max += way.cwiseMax(0.0);
    };
    context.workers.for_range(rests.size(), kParticleGrain, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i)
            if (!rests[i]) find(i);
    });
    for (size_t k = 0; k < context.scene.pins.size(); ++k) {
        if (!context.input.pins[k].active) continue;
        for (const ParticleId i : context.scene.pins[k].particles) {
            if (rests[i]) continue;
            const Pose pose = pin_pose(context.scene, context.input, k, i, end);
            const Aabb there = ball(pose.apply(context.scene.rest.rest_position[i]), size[i]);
            boxes[i].extend(there.min), boxes[i].extend(there.max);
        }
    }
    for (size_t k = 0; k < context.scene.sources.size(); ++k) {
        const FrameInput::SourceDrive& drive = context.input.sources[k];
        const SourceWay way(*drive.begin, *drive.end, drive.pivot, end);
        for (const ParticleId i : context.scene.sources[k].particles) {
            if (rests[i] || !follows(state, i)) continue;
            const Vec3& rest = context.scene.rest.rest_position[i];
            const Aabb there = ball(way.pose(context.scene.rest.fragment[i], rest).apply(rest), size[i]);
            boxes[i].extend(there.min), boxes[i].extend(there.max);
        }
    }
    return boxes;
}

}  // namespace sunder
