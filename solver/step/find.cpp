#include "solver/step/find.h"

#include <algorithm>

#include "solver/collision/movable_size.h"
#include "solver/contacts/memory/contact_memory.h"
#include "solver/contacts/solve/depenetration.h"
#include "solver/pieces/piece_motion.h"
#include "solver/scene/scales.h"
#include "solver/step/loops.h"

namespace sunder {

std::vector<Woken> find_contacts(const StepContext& context, const StepTime& time, const LiveTopology& live,
                                 const FrameState& state, const Movables& movables, bool may_wake,
                                 SceneContacts& detection, std::vector<ActiveContact>& contacts) {
    std::vector<Woken> woken;
    const auto waits = [&](MovableId i) {
        return i < state.inactive.size() && (state.inactive[i].what & Inactivity::kTouched) != 0;
    };
    // Where one of these wakes, the others need not be found: the step is taken again.
    const auto wakes = [&](std::span<const Contact> with_sleepers) {
        const double g = acceleration_of(context.input), h = time.h;
        for (const Contact& c : with_sleepers) {
            const MovableId i = context.fixed[c.a] ? c.b : c.a, sleeper = context.fixed[c.a] ? c.a : c.b;
            const bool is_particle = i < context.n_particles();
            const RigidBodyState* rigid = is_particle ? nullptr : &state.rigid_bodies[i - context.n_particles()];
            const Vec3& v = is_particle ? state.velocity[i] : rigid->velocity;
            const Vec3& w = is_particle ? state.angular_velocity[i] : rigid->angular_velocity;
            const Vec3 arm = (context.fixed[c.a] ? c.point_b : c.point_a) - movables.start_position[i];
            const double size = std::min(size_of(context.scene, i), size_of(context.scene, sleeper));
            const Vec3 velocity = v + w.cross(arm);
            const double approach = (context.fixed[c.a] ? 1 : -1) * c.normal.dot(velocity), hard = hard_speed(size, g);
            const bool touches = c.gap < (std::max(approach, 0.0) + g * h) * h;
            if (context.fixed[sleeper] == kStandsBy ||
                (touches && (approach > waking_speed(size, g) || velocity.norm() > hard || waits(sleeper))))
                woken.push_back({sleeper, approach > hard});
        }
        return !woken.empty();
    };
    SearchEnd search_end;
    if (!context.fixed.empty() && context.wakes && may_wake) search_end = {context.fixed, wakes};
    detection.find(context, live, movables.role,
                   {movables.start_position, movables.start_rotation, movables.velocity, movables.angular_velocity,
                    state.plastic_deformation},
                   {time.h, time.begin, time.end}, search_end, contacts);
    return woken;
}

void take_up_contacts(const StepContext& context, double h, const LiveTopology& live, std::span<const uint8_t> smooth,
                      const Slice& slice, const Movables& movables, ContactProblem& problem, Pieces& pieces) {
    pieces.of.resize(movables.size()), pieces.held_share.resize(movables.size());
    for_all(context, movables.size(), [&](size_t i) { pieces.of[i] = piece_of(live, i); });
    pieces.whole.resize(live.n_pieces() + context.scene.rigid_bodies.size());
    pieces.change.assign(pieces.whole.size(), PieceVelocity()), pieces.motion.resize(pieces.whole.size());
    pieces.angular.assign(live.n_pieces(), Vec3::Zero());
    remember_pieces(context, h, live, smooth, movables, pieces);
    for (size_t i = 0; i < std::min(context.fixed.size(), context.n_particles()); ++i)
        if (context.fixed[i]) pieces.whole[pieces.of[i]].rigid = true;  // what rests on it rests as on a rigid body
    if (slice.is_again) take_over_pieces(context, live, slice, pieces);
    const ContactBodies bodies = bodies_of(movables, pieces);
    for_contacts(context, problem.contacts, [&](std::span<ActiveContact> some) {
        prepare_contacts(bodies, movables.velocity, movables.angular_velocity, h, context.settings.depenetration_speed,
                         some);
    });
    agree_on_recovery(bodies, problem.contacts);
    find_islands(bodies, problem.contacts, static_cast<size_t>(context.workers.threads()), problem.islands);
    pieces.is_touched.assign(pieces.whole.size(), 0);
    for (const PieceId piece : problem.islands.piece) pieces.is_touched[piece] = 1;
}

void start_contacts(const StepContext& context, double h, const FrameState& state, const Slice& slice,
                    const ContactBodies& bodies, std::vector<ActiveContact>& contacts) {
    const double resting = resting_speed(h, acceleration_of(context.input));
    for_contacts(context, contacts,
                 [&](std::span<ActiveContact> some) { warm_start(bodies, state.contacts, h, resting, some); });
    if (slice.is_again) take_over_contacts(slice, contacts);
}

}  // namespace sunder
