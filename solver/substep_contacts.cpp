// Contacts of a substep: found, pushed apart between Newton steps, settled at the end.
#include <algorithm>

#include "solver/piece_motion.h"
#include "solver/substep.h"

namespace sunder {
namespace {

constexpr double kContactTolerance = 1e-4;  // of the contact margin: a change of gap below it ends the passes

}  // namespace

void Substep::mark_held_pieces() {
    work.piece_held.assign(work.live.n_pieces(), 0);
    for (size_t i = 0; i < n_particles(); ++i)
        if (work.held[i]) work.piece_held[work.live.piece(i)] = 1;
}

// Pieces as contacts see them, from the start of the substep; anew when edges broke.
void Substep::take_up_pieces() {
    for (size_t i = 0; i < n_movables(); ++i)
        work.piece[i] =
            static_cast<uint32_t>(i < n_particles() ? work.live.piece(i) : work.live.n_pieces() + (i - n_particles()));
    work.pieces.resize(work.live.n_pieces() + state.rigid_bodies.size());
    work.piece_change.resize(work.pieces.size());
    work.piece_angular.assign(work.live.n_pieces(), Vec3::Zero());
    remember_pieces(context, h, work);
    prepare_contacts(bodies(), work.velocity, work.angular_velocity, h, context.settings.depenetration_speed,
                     work.contacts);
    find_islands(bodies(), work.contacts, work.islands);
}

void Substep::find_contacts() {
    work.detection.find(context.scene, context.input, context.settings.self_collision, work.live, work.held,
                        {work.start_position, work.start_rotation, work.velocity, work.angular_velocity},
                        {h, begin, end}, work.contacts);
    report.contacts = std::max(report.contacts, work.contacts.size());
    take_up_pieces();
    divide_pushes(context, h, false, work);
    warm_start(bodies(), state.contacts, h, resting_speed(), work.contacts);
    move_pieces(context, work);
}

// A round over the contacts; `last`: no shape matching follows.
void Substep::push_apart(bool last) {
    Stopwatch watch(report.contact_s);
    divide_pushes(context, h, last, work);
    const double enough = kContactTolerance * work.detection.margin();
    relax_contacts(bodies(), work.islands, enough, work.contacts);
    move_pieces(context, work);
}

bool Substep::contacts_push() const {
    return std::any_of(work.contacts.begin(), work.contacts.end(),
                       [](const ActiveContact& c) { return c.normal_impulse > 0; });
}

void Substep::settle_contacts() {
    settle_velocities(bodies(), h, resting_speed(), work.contacts, work.angular_velocity, work.velocity,
                      work.piece_change);
    change_velocities(context, work);
    remember(bodies(), work.contacts, h, state.contacts);
}

}  // namespace sunder
