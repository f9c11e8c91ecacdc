// How things move between contacts and shape matching: prediction, velocities, momentum.
#include <limits>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/scene/motion.h"
#include "solver/substep.h"

namespace sunder {
namespace {

// What turns by more than that in a substep is not resolved: its momentum comes to lie along another of its axes, and a
// spin that is read as its opposite would be given twice to all of it, rad.
constexpr double kResolvedTurn = 1;
// Of a pin that begins to let go: its spring's frequency times the substep.
constexpr double kTightest = 1e3;

}  // namespace

// Positions and rotations since rest, into the workspace; inverse masses and inertia there; velocities as forces take
// them.
void Substep::load() {
    const FieldsOfForce fields(context.input);
    for_all(n_movables(), [&](size_t i) {
        if (work.kept[i]) return;
        MovingParticle& p = work.moving[i];
        if (i < n_particles()) {
            p.x = state.position[i];
            p.d = (state.orientation[i] * rest().rest_orientation[i].conjugate()).normalized();
            work.inertia[i] = turned_inertia(p.d, work.shapes.particle_moment[i]);
            work.inverse_mass[i] = 1.0 / rest().mass[i];
            work.velocity[i] = fields.after(h, state.velocity[i]);
            work.angular_velocity[i] = state.angular_velocity[i];
        } else {
            const RigidBodyState& body = state.rigid_bodies[i - n_particles()];
            p.x = body.position, p.d = body.orientation;
            work.inverse_mass[i] = 1.0 / context.scene.rigid_bodies[i - n_particles()].mass;
            work.velocity[i] = fields.after(h, body.velocity);
            work.angular_velocity[i] = body.angular_velocity;
        }
        work.start_position[i] = p.x;
        work.start_rotation[i] = p.d;
        work.push[i] = ContactPush();
    });
}

// Held particles take the speed of their pin.
void Substep::hold() {
    std::fill(work.held.begin(), work.held.end(), kFree);
    work.tether.clear(), work.tether_pose.clear();
    hold_pins(Pinned::at_the_end);
    if (!work.thin.empty()) {
        work.pinned.resize(n_particles());
        for (size_t i = 0; i < n_particles(); ++i) work.pinned[i] = work.held[i] == kHeldWhole;
    }
    take_up_bending(context, state, work);
    fix_sleepers();
    mark_held_pieces();
    work.unmoved.resize(n_particles());
    for_all(n_particles(), [&](size_t i) { work.unmoved[i] = work.held[i] | work.kept[i]; });
}

// Where inertia takes what is not held. What is bound and in a pair goes elsewhere (`begin_stage`).
void Substep::predict() {
    SubstepPair& pair = work.pair;
    if (!is_paired() || stage == Stage::first) pair.smooth.assign(n_movables(), is_paired());
    const std::vector<uint8_t> left_out = pieces_left_out();
    for_all(n_movables(), [&](size_t i) {
        if (left_out[piece_of(i)]) pair.smooth[i] = 0;
        const bool is_bound = i < n_particles() && work.live.count(i) > 1;
        if (work.held[i] == kHeldWhole || work.kept[i] || (pair.smooth[i] && is_bound)) return;
        MovingParticle& p = work.moving[i];
        p.d = p.d_inertial = (rotation_of(h * work.angular_velocity[i]) * work.start_rotation[i]).normalized();
        if (work.held[i]) return;
        p.x = p.x_inertial = work.start_position[i] + h * work.velocity[i];
        if (i >= n_particles() || !is_tied(i)) return;
        const double share = work.tether[i] / (1 + work.tether[i]);
        const Pose& pin = work.tether_pose[i];
        p.x = p.x_inertial = p.x + share * (pin.apply(rest().rest_position[i]) - p.x);
        p.d = p.d_inertial = slerp(p.d, share, pin.orientation);
    });
}

// A pin that lets go draws its particles to where it would hold them, by a spring for each: of (w h)^2 times its mass
// beside what inertia has in an implicit step, w falling evenly in its logarithm from far beyond all that the substep
// resolves to one over the time that it takes.
void Substep::tie(size_t pin) {
    const DrivenPose& drive = context.input.pins[pin];
    const Grip& grip = drive.grip;
    const double share = grip.begin + end * (grip.end - grip.begin);
    const double w = math::exp(share * math::log(kTightest * std::max(1.0, grip.time / h))) / std::max(grip.time, h);
    work.tether.resize(n_particles(), 0.0), work.tether_pose.resize(n_particles());
    const Pose pose = interpolate(drive, end);
    for (const ParticleId i : context.scene.pins[pin].particles)
        work.tether[i] = w * h * (w * h), work.tether_pose[i] = pose;
}

void Substep::hold_pins(Pinned when) {
    for (size_t k = 0; k < context.scene.pins.size(); ++k) {
        const DrivenPose& drive = context.input.pins[k];
        const bool turns = context.scene.pins[k].turns_freely && context.settings.method == Method::projective;
        if (!drive.active) continue;
        if (!drive.grip.is_rigid()) {
            if (when == Pinned::at_the_end) tie(k);
            continue;
        }
        Pose pose;
        double reached = -1;  // of the substep
        for (const ParticleId i : context.scene.pins[k].particles) {
            if (when != Pinned::at_the_end && !work.pair.smooth[i]) continue;
            const double wanted = when == Pinned::in_the_first_stage ? 2 * gamma_of(i) : 1;
            if (reached != wanted) {
                reached = wanted;
                pose = interpolate(drive, reached == 1 ? end : begin + reached * (end - begin));
            }
            MovingParticle& p = work.moving[i];
            p.x = p.x_inertial = pose.apply(rest().rest_position[i]);
            const double seconds = reached * h;
            work.velocity[i] = (p.x - work.start_position[i]) / seconds;
            work.inverse_mass[i] = 0;
            if (turns) {
                if (work.held[i] == kFree) work.held[i] = kHeldPlace;
                continue;
            }
            work.held[i] = kHeldWhole;
            p.d = p.d_inertial = pose.orientation;
            work.angular_velocity[i] = rotation_vector(p.d * work.start_rotation[i].conjugate()) / seconds;
        }
    }
}

void Substep::fix_sleepers() {
    for (size_t i = 0; i < context.fixed.size(); ++i) {
        if (!context.fixed[i]) continue;
        MovingParticle& p = work.moving[i];
        p.x_inertial = p.x, p.d_inertial = p.d;
        work.velocity[i] = work.angular_velocity[i] = Vec3::Zero();
        work.inverse_mass[i] = 0;
        work.held[i] = kHeldWhole;
    }
}

// Velocities and inertia where things came to.
Status Substep::take_up_motion() {
    FirstOf unsound;
    for_all(n_movables(), [&](size_t i) {
        const MovingParticle& p = work.moving[i];
        work.velocity[i] = (p.x - work.base[i]) / work.span[i];
        if (!work.pieces[work.piece[i]].rigid)
            work.angular_velocity[i] = rotation_vector(p.d * work.base_rotation[i].conjugate()) / work.span[i];
        if (!is_sound(i)) unsound.add(i);
        if (i >= n_particles()) return;
        work.inertia[i] = turned_inertia(p.d, work.shapes.particle_moment[i]);
        state.position[i] = p.x;
    });
    return check(unsound, "shape matching and fracture");
}

// Whether a free piece lies where inertia takes it, and has that momentum about its centre, to rounding.
bool Substep::has_momentum(size_t piece, const Vec3& angular) const {
    const auto particles = work.live.piece_particles(piece);
    const PieceMomentum p =
        piece_momentum(rest(), work.inertia, particles, state.position, work.velocity, work.angular_velocity);
    constexpr double kRounding = 1e-9;
    Vec3 departure = Vec3::Zero();
    double most = 0, most_angular = angular.norm();
    for (const ParticleId j : particles) {
        const double speed = work.velocity[j].norm(), lever = (state.position[j] - p.center).norm();
        const Vec3 own = work.moving[j].x - work.moving[j].x_inertial;
        departure += rest().mass[j] * own;
        most += rest().mass[j] * (own.norm() + 1e-5 * state.position[j].norm());  // rounded as it lies from the origin
        most_angular += rest().mass[j] * lever * speed + product(work.inertia[j], work.angular_velocity[j]).norm();
    }
    return departure.norm() <= kRounding * most && (p.angular - angular).norm() <= kRounding * most_angular;
}

// Each free piece gets the angular momentum that it had, plus what contacts gave it.
void Substep::restore_momentum() {
    for_pieces([&](size_t piece) {
        if (work.piece_held[piece] || work.pieces[piece].rigid) return;
        const auto particles = work.live.piece_particles(piece);
        // Levers of the start, as the contacts were solved with: the large pushes on a pinched piece cancel there,
        // while a millimetre more or less of lever would spin it.
        Vec3 gained = Vec3::Zero();
        for (const ParticleId j : particles)
            gained += rest().mass[j] * (work.start_position[j] - work.pieces[piece].center).cross(work.push[j].shift) +
                      work.push[j].torque;
        const Vec3 wanted = work.piece_angular[piece] + gained / h, turn = work.pieces[piece].inverse_inertia * wanted;
        work.pieces[piece].spin = turn;
        const bool is_resolved = !(turn.norm() * h > kResolvedTurn);
        const double most_energy = is_resolved ? std::numeric_limits<double>::max() : 0.5 * turn.dot(wanted);
        set_angular_momentum(rest(), work.inertia, particles, wanted, most_energy, state.position, work.velocity,
                             work.angular_velocity);
        if (context.settings.method != Method::gauss_seidel && is_resolved)
            invariant("the momentum of a piece is closed", [&] { return has_momentum(piece, wanted); });
    });
}

Status Substep::store() {
    FirstOf unsound;
    if (stage == Stage::first) begin_middle();
    // What is smooth came to the end of its pair undamped.
    const double keep_once = math::exp(-context.settings.damping * h);
    const auto keep = [&](size_t i) {
        return stage == Stage::second && work.pair.smooth[i] ? keep_once * keep_once : keep_once;
    };
    for_all(n_movables(), [&](size_t i) {
        // What is fixed stays to the bit: rotations that come and go through rest are rounded each time.
        if (!context.fixed.empty() && context.fixed[i]) return;
        if (!is_sound(i)) unsound.add(i);
        if (stage == Stage::first) go_on_to_the_middle(i);
        const MovingParticle& p = work.moving[i];
        const double keep_spin = work.pieces[work.piece[i]].rigid ? keep_once : keep(i);  // turns a substep at a time
        const Vec3 velocity = keep(i) * work.velocity[i], spin = keep_spin * work.angular_velocity[i];
        if (i < n_particles()) {
            state.position[i] = p.x;
            state.orientation[i] = (p.d * rest().rest_orientation[i]).normalized();
            state.velocity[i] = velocity;
            state.angular_velocity[i] = spin;
            state.group_rotation[i] = work.goals[i].rotation;
        } else {
            state.rigid_bodies[i - n_particles()] = {p.x, p.d, velocity, spin};
        }
    });
    if (Status ok = check(unsound, "contacts"); !ok) return ok;
    state.time += h;
    return {};
}

}  // namespace sunder
