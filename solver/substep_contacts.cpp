// Contacts of a substep: found, pushed apart between Newton steps, settled at the end.
#include <algorithm>

#include "solver/contacts/contact_memory.h"
#include "solver/contacts/depenetration.h"
#include "solver/data/invariant.h"
#include "solver/piece_motion.h"
#include "solver/sleeping.h"
#include "solver/standing_loads.h"
#include "solver/substep.h"

namespace sunder {
namespace {

// A change of gap below these ends the passes: of the contact margin, and of the way that things fall in a substep.
constexpr double kOfTheMargin = 1e-4, kOfTheFall = 0.003;

}  // namespace

void Substep::mark_held_pieces() {
    work.piece_held.resize(work.live.n_pieces()), work.piece_unmoved.resize(work.live.n_pieces());
    for_pieces([&](size_t piece) {
        const auto particles = work.live.piece_particles(piece);
        work.piece_held[piece] =
            std::ranges::any_of(particles, [&](ParticleId j) { return work.held[j] != kFree || is_tied(j); });
        work.piece_unmoved[piece] = work.piece_held[piece] | work.kept[particles.front()];
    });
}

// Pieces as contacts see them, from the start of the substep; anew when edges broke.
void Substep::take_up_pieces() {
    if (work.is_taken_again) {
        std::swap(work.pieces, work.former_pieces), std::swap(work.piece_change, work.former_change);
        std::swap(work.piece, work.former_piece);
        work.piece.resize(n_movables());
    }
    for_all(n_movables(), [&](size_t i) { work.piece[i] = piece_of(i); });
    work.pieces.resize(work.live.n_pieces() + state.rigid_bodies.size());
    work.piece_change.assign(work.pieces.size(), PieceVelocity()), work.piece_motion.resize(work.pieces.size());
    work.piece_angular.assign(work.live.n_pieces(), Vec3::Zero());
    remember_pieces(context, h, work);
    for (size_t i = 0; i < std::min(context.fixed.size(), n_particles()); ++i)
        if (context.fixed[i]) work.pieces[work.piece[i]].rigid = true;  // what rests on it rests as on a rigid body
    if (work.is_taken_again) take_over_pieces();
    for_contacts([&](std::span<ActiveContact> some) {
        prepare_contacts(bodies(), work.velocity, work.angular_velocity, h, context.settings.depenetration_speed, some);
    });
    agree_on_recovery(bodies(), work.contacts);
    find_islands(bodies(), work.contacts, static_cast<size_t>(context.workers.threads()), work.islands);
    work.is_touched.assign(work.pieces.size(), 0);
    for (const PieceId piece : work.islands.piece) work.is_touched[piece] = 1;
}

void Substep::find_contacts() {
    work.woken.clear();
    if (work.is_taken_again) std::swap(work.contacts, work.former_contacts);
    // Where one of these wakes, the others need not be found: the substep is taken again.
    const auto wakes = [&](std::span<const Contact> with_sleepers) {
        const double g = acceleration_of(context.input);
        for (const Contact& c : with_sleepers) {
            const MovableId i = context.fixed[c.a] ? c.b : c.a, sleeper = context.fixed[c.a] ? c.a : c.b;
            const bool is_particle = i < n_particles();
            const RigidBodyState* rigid = is_particle ? nullptr : &state.rigid_bodies[i - n_particles()];
            const Vec3& v = is_particle ? state.velocity[i] : rigid->velocity;
            const Vec3& w = is_particle ? state.angular_velocity[i] : rigid->angular_velocity;
            const Vec3 arm = (context.fixed[c.a] ? c.point_b : c.point_a) - work.start_position[i];
            const double size = std::min(size_of(context.scene, i), size_of(context.scene, sleeper));
            const Vec3 velocity = v + w.cross(arm);
            const double approach = (context.fixed[c.a] ? 1 : -1) * c.normal.dot(velocity), hard = hard_speed(size, g);
            const bool touches = c.gap < (std::max(approach, 0.0) + g * h) * h;
            if (context.fixed[sleeper] == kStandsBy ||
                (touches && (approach > waking_speed(size, g) || velocity.norm() > hard)))
                work.woken.push_back({sleeper, approach > hard});
        }
        return !work.woken.empty();
    };
    SearchEnd search_end;
    if (!context.fixed.empty() && context.wakes && !work.is_taken_again) search_end = {context.fixed, wakes};
    const bool complete = work.detection.find(
        context.scene, context.input, context.settings.self_collision, work.live, work.held,
        {work.start_position, work.start_rotation, work.velocity, work.angular_velocity, state.plastic_deformation},
        {h, begin, end}, context.contact_margin, search_end, context.workers, work.contacts);
    if (!complete) return;
    report.contacts = std::max(report.contacts, work.contacts.size());
    predict();
    take_up_pieces();
    for_contacts(
        [&](std::span<ActiveContact> some) { warm_start(bodies(), state.contacts, h, resting_speed(), some); });
    if (work.is_taken_again) take_over_contacts();
}

// A round over the contacts, the first with what they start from; `last`: no shape matching follows. All of an island
// is done by one thread at a time.
void Substep::push_apart(ContactRound::Which which, int sweep) {
    using Which = ContactRound::Which;
    Stopwatch watch(report.contact_s);
    const bool last = which == Which::last;
    // Sweeps, other than Newton steps, find what pushes did in where particles are.
    const bool as_wholes = which == Which::first && context.settings.method == Method::projective;
    const double enough =
        std::max(kOfTheMargin * context.contact_margin, kOfTheFall * fall_in_step(h, acceleration_of(context.input)));
    const auto is_left_out = [&](IslandId island) {
        const auto movables = work.islands.movables_of(island);
        const uint8_t kept = work.kept[movables.front()];  // all of it, or nothing
        SUNDER_ASSERT(std::ranges::all_of(movables, [&](MovableId i) { return work.kept[i] == kept; }));
        return kept || (which == Which::between && sweep >= newton_steps(island));
    };
    using How = StandingLoads::How;
    const std::vector<How>& how = work.loads.how;
    ContactRound& round = work.round;
    if (which == Which::first) work.loads.open(work.islands);
    work.round_push.resize(work.islands.movable.size());
    round.open(bodies(), work.islands, which, context.contact_margin, work.contacts);
    work.islands.for_each(context.workers, [&](IslandId island) {
        if (is_left_out(island)) return;
        turn_pieces(context, island, work);
        divide_pushes(context, h, last, island, work);
        if (as_wholes) find_standing_loads(context, h, state.strain, island, work);
        if (which == Which::first)
            temper_warm_start(bodies(), work.islands, island, h, acceleration_of(context.input), work.piece_motion,
                              work.contacts);
        round.take_up(island);
    });
    round.lay_out();
    work.islands.for_each(context.workers, [&](IslandId island) {
        if (is_left_out(island)) return;
        round.start(island);
        if (last || how[island] == How::not_at_all || (how[island] == How::kept && which == Which::between))
            round.relax(island, enough);
        round.end(island, work.round_push, work.piece_motion, work.brace);
        if (last) round.hand_over(island, work.contacts);
        if (last) note_what_pins_take(context, h, island, work);
        move_pieces(context, as_wholes, island, work);
        if (!last && how[island] == How::together) brace_bearers(context, h, which == Which::first, island, work);
    });
}

bool Substep::contacts_push() const {
    return std::any_of(work.contacts.begin(), work.contacts.end(),
                       [](const ActiveContact& c) { return c.impulse.normal > 0; });
}

void Substep::settle_contacts() {
    slow_held_pieces(context, work);
    work.islands.for_each(context.workers, [&](IslandId island) {
        settle_velocities(bodies(), h, resting_speed(), work.contacts, work.islands.contacts_of(island),
                          work.angular_velocity, work.velocity, work.piece_change);
    });
    change_velocities(context, work);
    remember(bodies(), work.contacts, h, acceleration_of(context.input), state.contacts);
}

}  // namespace sunder
