#include "solver/step/books.h"

#include <cmath>
#include <limits>
#include <string>

#include "solver/contacts/memory/contact_memory.h"
#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/pieces/momentum.h"
#include "solver/pieces/piece_motion.h"
#include "solver/scene/motion.h"
#include "solver/scene/scales.h"
#include "solver/step/letting_go.h"
#include "solver/step/loops.h"
#include "solver/threads/first_of.h"

namespace sunder {
namespace {

constexpr double kRunawaySpeed = 1e5;  // m/s; nothing that an artist animates is faster: numbers went bad
// What turns by more than that in a step is not resolved: its momentum comes to lie along another of its axes, and a
// spin that is read as its opposite would be given twice to all of it, rad.
constexpr double kResolvedTurn = 1;

// Where numbers are not finite, nor is their sum.
bool is_sound(const Movables& movables, size_t i) {
    const MovingParticle& p = movables.moving[i];
    const double sum = p.x.sum() + p.d.coeffs().sum() + movables.angular_velocity[i].sum();
    return std::isfinite(sum) && movables.velocity[i].squaredNorm() < kRunawaySpeed * kRunawaySpeed;
}

Status check(const StepContext& context, double time, const Movables& movables, size_t i, const char* stage) {
    const size_t n = context.n_particles();
    if (i >= movables.size()) return {};
    const MovingParticle& p = movables.moving[i];
    const bool finite = p.x.allFinite() && p.d.coeffs().allFinite() && movables.velocity[i].allFinite() &&
                        movables.angular_velocity[i].allFinite();
    const SimulationMesh& rest = context.scene.rest;
    const std::string who = i < n ? "particle " + std::to_string(i) + " (body '" +
                                        context.scene.bodies[rest.body[i]].name + "', fragment " +
                                        std::to_string(rest.fragment[i]) + ")"
                                  : "rigid body '" + context.scene.rigid_bodies[i - n].name + "'";
    return Error{ErrorCode::numerical,
                 who + (finite ? " runs away (above 1e5 m/s)" : " is not finite") + " after " + stage,
                 "time " + std::to_string(time) + " s",
                 "use more substeps, or a smaller stiffness or force",
                 {},
                 {}};
}

// Whether a free piece lies where inertia takes it, and has that momentum about its centre, to rounding.
bool has_momentum(const SimulationMesh& rest, std::span<const ParticleId> particles, const Movables& movables,
                  const FrameState& state, const Vec3& angular) {
    const PieceMomentum p =
        piece_momentum(rest, movables.inertia, particles, state.position, movables.velocity, movables.angular_velocity);
    constexpr double kRounding = 1e-9;
    Vec3 departure = Vec3::Zero();
    double most = 0, most_angular = angular.norm();
    for (const ParticleId j : particles) {
        const double speed = movables.velocity[j].norm(), lever = (state.position[j] - p.center).norm();
        const Vec3 own = movables.moving[j].x - movables.moving[j].x_inertial;
        departure += rest.mass[j] * own;
        most += rest.mass[j] * (own.norm() + 1e-5 * state.position[j].norm());  // rounded as it lies from the origin
        most_angular +=
            rest.mass[j] * lever * speed + product(movables.inertia[j], movables.angular_velocity[j]).norm();
    }
    return departure.norm() <= kRounding * most && (p.angular - angular).norm() <= kRounding * most_angular;
}

}  // namespace

Status take_up_motion(const StepContext& context, const GroupShapes& shapes, const Pieces& pieces, Movables& movables,
                      FrameState& state) {
    FirstOf unsound;
    for_all(context, movables.size(), [&](size_t i) {
        const MovingParticle& p = movables.moving[i];
        movables.velocity[i] = (p.x - movables.base[i]) / movables.span[i];
        if (!pieces.whole[pieces.of[i]].rigid)
            movables.angular_velocity[i] =
                rotation_vector(p.d * movables.base_rotation[i].conjugate()) / movables.span[i];
        if (!is_sound(movables, i)) unsound.add(i);
        if (i >= context.n_particles()) return;
        movables.inertia[i] = turned_inertia(p.d, shapes.particle_moment[i]);
        state.position[i] = p.x;
    });
    return check(context, state.time, movables, unsound.get(), "shape matching and fracture");
}

void restore_momentum(const StepContext& context, double h, const LiveModel& model, const FrameState& state,
                      Pieces& pieces, Movables& movables) {
    const LiveTopology& live = model.live;
    const SimulationMesh& rest = context.scene.rest;
    for_pieces(live, kParticleGrain, context.workers, [&](size_t piece) {
        ContactPiece& whole = pieces.whole[piece];
        if (pieces.held[piece] || whole.rigid) return;
        const auto particles = live.piece_particles(piece);
        // Levers of the start, as the contacts were solved with: the large pushes on a pinched piece cancel there,
        // while a millimetre more or less of lever would spin it.
        Vec3 gained = Vec3::Zero();
        for (const ParticleId j : particles)
            gained += rest.mass[j] * (movables.start_position[j] - whole.center).cross(movables.push[j].shift) +
                      movables.push[j].torque;
        const Vec3 wanted = pieces.angular[piece] + gained / h, turn = whole.inverse_inertia * wanted;
        whole.spin = turn;
        const bool turns_far = turn.norm() * h > kFarTurn && bends_stiffly(model, particles, h);
        const bool is_resolved = !turns_far && !(turn.norm() * h > kResolvedTurn);
        const double most_energy = is_resolved ? std::numeric_limits<double>::max() : 0.5 * turn.dot(wanted);
        set_angular_momentum(rest, movables.inertia, particles, wanted, most_energy, state.position, movables.velocity,
                             movables.angular_velocity);
        if (context.settings.method != Method::gauss_seidel && is_resolved)
            invariant("the momentum of a piece is closed",
                      [&] { return has_momentum(rest, particles, movables, state, wanted); });
    });
}

void settle_contacts(const StepContext& context, double h, const LiveTopology& live, const ContactProblem& problem,
                     Pieces& pieces, Movables& movables, FrameState& state) {
    const double g = acceleration_of(context.input), resting = resting_speed(h, g);
    const ContactBodies bodies = bodies_of(movables, pieces);
    slow_held_pieces(context, live, movables, pieces);
    problem.islands.for_each(context.workers, [&](IslandId island) {
        settle_velocities(bodies, h, resting, problem.contacts, problem.islands.contacts_of(island),
                          movables.angular_velocity, movables.velocity, pieces.change);
    });
    change_velocities(context, live, pieces, movables);
    remember(bodies, problem.contacts, h, g, state.contacts);
}

Status store(const StepContext& context, const StepTime& time, std::span<const GroupGoal> goals, const Pieces& pieces,
             StepPair& pair, Movables& movables, FrameState& state) {
    const size_t n = context.n_particles();
    FirstOf unsound;
    if (time.stage == Stage::first) begin_middle(context, time, pair, movables);
    // What is smooth came to the end of its pair undamped.
    const double keep_once = math::exp(-context.settings.damping * time.h);
    const auto keep = [&](size_t i) {
        return time.stage == Stage::second && pair.smooth[i] ? keep_once * keep_once : keep_once;
    };
    for_all(context, movables.size(), [&](size_t i) {
        // What is fixed stays to the bit: rotations that come and go through rest are rounded each time.
        if (!context.fixed.empty() && context.fixed[i]) return;
        if (!is_sound(movables, i)) unsound.add(i);
        if (time.stage == Stage::first) go_on_to_the_middle(context, time.h, pieces, i, pair, movables);
        const MovingParticle& p = movables.moving[i];
        const double keep_spin = pieces.whole[pieces.of[i]].rigid ? keep_once : keep(i);  // turns a step at a time
        const Vec3 velocity = keep(i) * movables.velocity[i], spin = keep_spin * movables.angular_velocity[i];
        const bool follows = !movables.follows.empty() && movables.follows[i];
        if (i < n && is_kept(state, i) && !follows && p.x == movables.start_position[i]) {  // stays to the bit, too
            state.velocity[i] = state.angular_velocity[i] = Vec3::Zero();
            state.group_rotation[i] = goals[i].rotation;
        } else if (i < n) {
            state.position[i] = p.x;
            state.orientation[i] = (p.d * context.scene.rest.rest_orientation[i]).normalized();
            state.velocity[i] = velocity;
            state.angular_velocity[i] = spin;
            state.group_rotation[i] = goals[i].rotation;
        } else {
            state.rigid_bodies[i - n] = {p.x, p.d, velocity, spin};
        }
    });
    if (Status ok = check(context, state.time, movables, unsound.get(), "contacts"); !ok) return ok;
    state.time += time.h;
    return {};
}

}  // namespace sunder
