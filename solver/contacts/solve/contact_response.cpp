#include "solver/contacts/solve/contact_response.h"

#include <algorithm>
#include <cmath>

#include "solver/contacts/solve/depenetration.h"
#include "solver/data/invariant.h"

namespace sunder {

Vec3 lever_of(const ContactBodies& b, MovableIndex i) { return b.start_position[i] - b.pieces[b.piece[i]].center; }

PushDivision divide_push(const ContactBodies& b, MovableIndex i) {
    const ContactPiece& p = b.pieces[b.piece[i]];
    if (b.inverse_mass[i] == 0) return {};
    if (p.rigid) return {b.inverse_mass[i], 0, 0, Vec3::Zero()};
    const double s = p.is_held() ? b.held_share[i] : p.own_share;
    return {s * b.inverse_mass[i], (1 - s) * p.inverse_mass, 1 - s, lever_of(b, i)};
}

Vec3 turned(const ContactBodies& b, MovableIndex i) {
    const ContactPiece& p = b.pieces[b.piece[i]];
    if (p.rigid || b.inverse_mass[i] > 0) return p.turned;
    return turned_by(b.moving[i].d * b.start_rotation[i].conjugate());
}

namespace {

// Of old overlap, what is worked off in a substep, and in a second: a fifth in the default substep and in longer ones.
// What vibrates has points that its fragments' own turns sink and lift again; lifted out by a fifth in each of many
// short substeps, they drove it.
constexpr double kMostRecovery = 0.2, kRecoveryRate = 0.2 * 8 * 24;  // -, 1/s

// What turns a touching point about its centre, as `turned` has it, rad/s.
const Vec3& spin_of(const ContactBodies& b, std::span<const Vec3> angular_velocity, MovableIndex i) {
    const ContactPiece& p = b.pieces[b.piece[i]];
    return p.rigid || b.inverse_mass[i] == 0 ? angular_velocity[i] : p.spin;
}

}  // namespace

void prepare_contacts(const ContactBodies& b, std::span<const Vec3> velocity, std::span<const Vec3> angular_velocity,
                      double h, double recovery_speed, std::span<ActiveContact> io_contacts) {
    SUNDER_ASSERT(h > 0 && recovery_speed > 0);
    SUNDER_ASSERT(velocity.size() == b.piece.size() && angular_velocity.size() == b.piece.size());
    const double share = std::min(kMostRecovery, kRecoveryRate * h);
    for (ActiveContact& c : io_contacts) {
        const MovableId i = c.contact.a;
        c.arm_a = c.contact.point_a - b.start_position[i];
        Vec3 approach = velocity[i] + spin_of(b, angular_velocity, i).cross(c.arm_a);
        if (has_movable_b(c.contact)) {
            const MovableId j = c.contact.b;
            c.arm_b = c.contact.point_b - b.start_position[j];
            approach -= velocity[j] + spin_of(b, angular_velocity, j).cross(c.arm_b);
        } else {
            c.arm_b = Vec3::Zero();
            approach -= c.collider_motion / h;
        }
        c.approach_speed = -c.contact.normal.dot(approach);
        const double overlap = c.allowed_gap - c.contact.gap;
        c.recovery = c.separate_pieces && overlap > 0 ? std::min(share * overlap, recovery_speed * h) : 0.0;
    }
}

void settle_velocities(const ContactBodies& b, double h, double threshold, std::span<const ActiveContact> contacts,
                       std::span<const ContactId> which, std::span<const Vec3> angular_velocity,
                       std::span<Vec3> io_velocity, std::span<PieceVelocity> io_change) {
    SUNDER_ASSERT(h > 0 && io_velocity.size() == b.piece.size() && io_change.size() == b.pieces.size());
    const auto velocity_at = [&](MovableId i, const Vec3& arm) -> Vec3 {
        const PieceVelocity& whole = io_change[b.piece[i]];
        return io_velocity[i] + whole.velocity + whole.turn.cross(lever_of(b, i)) +
               (spin_of(b, angular_velocity, i) + whole.spin).cross(arm);
    };
    const auto push = [&](MovableId i, const Vec3& arm, const Vec3& impulse) {
        const PushDivision d = divide_push(b, i);
        const Mat3& J = b.pieces[b.piece[i]].inverse_inertia;
        const Vec3 by_arm = J * arm.cross(impulse), by_lever = J * d.lever.cross(impulse);
        PieceVelocity& change = io_change[b.piece[i]];
        io_velocity[i] += d.own * impulse;
        change.velocity += d.whole * impulse;
        change.turn += by_arm + d.orbit_share * by_lever;
        change.spin += by_arm + by_lever;
    };
    for (const ContactId k : which) {
        const ActiveContact& c = contacts[k];
        if (c.impulse.normal <= 0 || !(c.inverse_mass_normal > 0)) continue;
        const Vec3& n = c.contact.normal;
        const MovableId i = c.contact.a, j = c.contact.b;
        const bool movable = has_movable_b(c.contact);
        const Vec3 other = movable ? velocity_at(j, c.arm_b) : Vec3(c.collider_motion / h);
        const double speed = n.dot(velocity_at(i, c.arm_a) - other);
        // With no more energy than what came lost by the push, and is to lose yet: what gives way, or is stopped by
        // others, too, must not get all of its approach back from each.
        const double came = c.approach_speed, left = std::max(-speed, 0.0);
        const double lost = c.inverse_mass_normal * c.impulse.normal / h * (came + left) + left * left;
        const double bounce = came > threshold ? c.restitution * std::min(came, std::sqrt(lost)) : 0.0;
        double change = bounce > 0 ? std::max(bounce - speed, 0.0) : 0.0;
        if (speed > bounce) change = -std::min(speed - bounce, c.recovery / h);
        if (change == 0) continue;
        const Vec3 impulse = change / c.inverse_mass_normal * n;
        if (b.inverse_mass[i] > 0) push(i, c.arm_a, impulse);
        if (movable && b.inverse_mass[j] > 0) push(j, c.arm_b, -impulse);
    }
}

}  // namespace sunder
