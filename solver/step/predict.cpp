#include "solver/step/predict.h"

#include <algorithm>

#include "solver/pieces/momentum.h"
#include "solver/pieces/piece_motion.h"
#include "solver/scene/motion.h"
#include "solver/scene/scales.h"
#include "solver/step/following.h"
#include "solver/step/letting_go.h"
#include "solver/step/loops.h"
#include "solver/step/pins.h"

namespace sunder {
namespace {

// Velocities, once forces that are the same everywhere took them, as those take them that differ from place to place.
void pull_along(const StepContext& context, const StepTime& time, const FrameState& state,
                std::span<const uint8_t> kept, Movables& movables) {
    const LocalFields local(context.scene, context.input, state, context.fixed);
    movables.pull.resize(local.empty() ? 0 : movables.size());
    if (local.empty()) return;
    const double h = time.h, slowed = 1 + h * FieldsOfForce(context.input).drag;
    for_all(context, movables.size(), [&](size_t i) {
        if (kept[i]) return;
        Pull& pull = movables.pull[i] =
            local.on({i, movables.start_position[i], movables.start_rotation[i], h, time.begin, time.end});
        if (!pull.acts()) return;
        // (v + h (a + a')) / (1 + h (d + d')), of (v + h a) / (1 + h d)
        movables.velocity[i] = (slowed * movables.velocity[i] + h * pull.acceleration) / (slowed + h * pull.drag);
        movables.angular_velocity[i] = (movables.angular_velocity[i] + h * pull.turn) / (1 + h * pull.turn_drag);
    });
}

}  // namespace

void load(const StepContext& context, const StepTime& time, const FrameState& state, const GroupShapes& shapes,
          std::span<const uint8_t> kept, Movables& movables) {
    const SimulationMesh& rest = context.scene.rest;
    const size_t n = context.n_particles();
    const double h = time.h;
    const FieldsOfForce fields(context.input);
    for_all(context, movables.size(), [&](size_t i) {
        if (kept[i]) return;
        MovingParticle& p = movables.moving[i];
        if (i < n) {
            p.x = state.position[i];
            p.d = (state.orientation[i] * rest.rest_orientation[i].conjugate()).normalized();
            movables.inertia[i] = turned_inertia(p.d, shapes.particle_moment[i]);
            movables.inverse_mass[i] = 1.0 / rest.mass[i];
            movables.velocity[i] = fields.after(h, state.velocity[i]);
            movables.angular_velocity[i] = state.angular_velocity[i];
        } else {
            const RigidBodyState& body = state.rigid_bodies[i - n];
            p.x = body.position, p.d = body.orientation;
            movables.inverse_mass[i] = 1.0 / context.scene.rigid_bodies[i - n].mass;
            movables.velocity[i] = fields.after(h, body.velocity);
            movables.angular_velocity[i] = body.angular_velocity;
        }
        movables.start_position[i] = p.x;
        movables.start_rotation[i] = p.d;
        movables.push[i] = ContactPush();
    });
    pull_along(context, time, state, kept, movables);
}

namespace {

void fix_sleepers(std::span<const uint8_t> fixed, Movables& movables) {
    for (size_t i = 0; i < fixed.size(); ++i) {
        if (!fixed[i]) continue;
        MovingParticle& p = movables.moving[i];
        p.x_inertial = p.x, p.d_inertial = p.d;
        movables.velocity[i] = movables.angular_velocity[i] = Vec3::Zero();
        movables.inverse_mass[i] = 0;
        movables.role[i] = Role::held;
    }
}

}  // namespace

void hold(const StepContext& context, const StepTime& time, const FrameState& state, const StepPair& pair,
          LiveModel& model, Movables& movables) {
    std::ranges::fill(movables.role, Role::free);
    movables.tethers.clear();
    hold_pins(context, time, Pinned::at_the_end, pair, movables);
    take_up_followers(context, time, state, movables);
    hold_inactive(state, movables);
    if (!model.thin.empty()) {
        model.pinned.resize(context.n_particles());
        for (size_t i = 0; i < context.n_particles(); ++i) model.pinned[i] = movables.role[i] == Role::held;
    }
    model.take_up_bending(context.scene.rest, state, context.workers);
    fix_sleepers(context.fixed, movables);
}

void mark_held_pieces(const StepContext& context, const LiveTopology& live, const Movables& movables, Pieces& pieces) {
    pieces.held.resize(live.n_pieces());
    for_pieces(live, kParticleGrain, context.workers, [&](size_t piece) {
        pieces.held[piece] =
            std::ranges::any_of(live.piece_particles(piece), [&](ParticleId j) { return movables.is_held_or_tied(j); });
    });
}

void predict(const StepContext& context, const StepTime& time, const LiveModel& model, std::span<const uint8_t> kept,
             std::span<const ActiveContact> contacts, StepPair& pair, Movables& movables) {
    const SimulationMesh& rest = context.scene.rest;
    const size_t n = context.n_particles();
    const bool paired = is_paired(context, time.stage);
    if (!paired || time.stage == Stage::first) pair.smooth.assign(movables.size(), paired);
    const std::vector<uint8_t> left_out = pieces_left_out(context, time, model, contacts, movables);
    for_all(context, movables.size(), [&](size_t i) {
        if (left_out[piece_of(model.live, i)]) pair.smooth[i] = 0;
        const bool is_bound = i < n && model.live.count(i) > 1;
        if (movables.role[i] == Role::held || kept[i] || (pair.smooth[i] && is_bound)) return;
        MovingParticle& p = movables.moving[i];
        p.d = p.d_inertial =
            (rotation_of(time.h * movables.angular_velocity[i]) * movables.start_rotation[i]).normalized();
        if (movables.role[i] != Role::free) return;
        p.x = p.x_inertial = movables.start_position[i] + time.h * movables.velocity[i];
        if (i >= n || !movables.tethers.hold(i)) return;
        const double share = movables.tethers.stiffness[i] / (1 + movables.tethers.stiffness[i]);
        const Pose& pin = movables.tethers.pose[i];
        p.x = p.x_inertial = p.x + share * (pin.apply(rest.rest_position[i]) - p.x);
        p.d = p.d_inertial = slerp(p.d, share, pin.orientation);
    });
    predict_turns(context, time.h, model, kept, pair.smooth, movables);
}

}  // namespace sunder
