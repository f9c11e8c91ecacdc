#include "solver/collision/contact_response.h"

#include <algorithm>
#include <cmath>

#include "solver/collision/depenetration.h"

namespace sunder {
namespace {

// Share of the last force that a contact starts from: at rest, where nothing hangs on hinges, and else. More makes
// piles of broken pieces swing (the force follows the deformation by a substep) and gives hits twice; less lets stacks
// creep.
constexpr double kRestingWarmStart = 0.9, kWarmStart = 0.5;
// A force lasts as at most so many times what lasted of it before, and so many weights of the lighter thing; where
// there is no gravity, as if there was some.
constexpr double kGrowth = 1.5, kWeights = 10, kLeastAcceleration = 1;  // -, -, m/s2

// A particle of a soft piece does not: what it hangs on turns it back, and with remembered torques soft columns sway.
bool turns_as_a_whole(const ContactBodies& b, const Contact& c) {
    return b.pieces[b.piece[c.a]].rigid || (has_movable_b(c) && b.pieces[b.piece[c.b]].rigid);
}

Vec3 lever_of(const ContactBodies& b, uint32_t i) { return b.start_position[i] - b.pieces[b.piece[i]].center; }

}  // namespace

PushDivision divide_push(const ContactBodies& b, uint32_t i) {
    const ContactPiece& p = b.pieces[b.piece[i]];
    if (b.inverse_mass[i] == 0) return {};
    if (p.rigid) return {b.inverse_mass[i], 0, 0, Vec3::Zero()};
    const double s = p.own_share;
    return {s * b.inverse_mass[i], (1 - s) * p.inverse_mass, 1 - s, lever_of(b, i)};
}

Vec3 turned(const ContactBodies& b, uint32_t i) {
    const ContactPiece& p = b.pieces[b.piece[i]];
    if (p.rigid || p.inverse_mass > 0) return p.turned;
    return turned_by(b.moving[i].d * b.start_rotation[i].conjugate());
}

void prepare_contacts(const ContactBodies& b, std::span<const Vec3> velocity, std::span<const Vec3> angular_velocity,
                      double h, double recovery_speed, std::span<ActiveContact> io_contacts) {
    for (ActiveContact& c : io_contacts) {
        const uint32_t i = c.contact.a;
        c.arm_a = c.contact.point_a - b.start_position[i];
        Vec3 approach = velocity[i] + angular_velocity[i].cross(c.arm_a);
        if (has_movable_b(c.contact)) {
            const uint32_t j = c.contact.b;
            c.arm_b = c.contact.point_b - b.start_position[j];
            approach -= velocity[j] + angular_velocity[j].cross(c.arm_b);
        } else {
            c.arm_b = Vec3::Zero();
            approach -= c.collider_motion / h;
        }
        c.approach_speed = -c.contact.normal.dot(approach);
        const double overlap = c.allowed_gap - c.contact.gap;
        c.recovery = c.separate_pieces && overlap > 0 ? std::min(0.2 * overlap, recovery_speed * h) : 0.0;
    }
}

void warm_start(const ContactBodies& b, std::span<const ContactMemory> memory, double h, double resting,
                std::span<ActiveContact> io_contacts) {
    const auto pair_of = [](const auto& c) { return std::pair(c.a, c.b); };
    if (io_contacts.empty()) return;
    auto first = static_cast<size_t>(
        std::ranges::lower_bound(memory, pair_of(io_contacts.front().contact), {}, pair_of) - memory.begin());
    for (ActiveContact& c : io_contacts) {
        const bool movable =
            b.inverse_mass[c.contact.a] > 0 || (has_movable_b(c.contact) && b.inverse_mass[c.contact.b] > 0);
        if (!movable || c.wanted_gap <= -kLetPass) continue;
        const auto key = pair_of(c.contact);
        while (first < memory.size() && pair_of(memory[first]) < key) ++first;
        // Of the points that this pair had, the nearest, if it moved by less than a tenth of its arm.
        const Vec3 point = b.start_rotation[c.contact.a].conjugate() * c.arm_a;
        const ContactMemory* nearest = nullptr;
        double least = 0.1 * point.norm();
        for (size_t k = first; k < memory.size() && pair_of(memory[k]) == key; ++k)
            if (const double d = (memory[k].point - point).norm(); d <= least) least = d, nearest = &memory[k];
        if (!nearest) continue;
        const Vec3& n = c.contact.normal;
        const double share = std::abs(c.approach_speed) <= resting && !c.has_hinges ? kRestingWarmStart : kWarmStart;
        c.before.normal = h * h * nearest->normal_force;
        c.before.friction = h * h * (nearest->friction_force - n * n.dot(nearest->friction_force));
        if (turns_as_a_whole(b, c.contact)) c.before.rolling = h * h * nearest->rolling_torque;
        c.impulse = share * c.before;
    }
}

void remember(const ContactBodies& b, std::span<const ActiveContact> contacts, double h, double acceleration,
              std::vector<ContactMemory>& o_memory) {
    o_memory.clear();
    for (const ActiveContact& c : contacts) {
        if (c.impulse.normal <= 0) continue;
        const double inverse_mass =
            std::max(b.inverse_mass[c.contact.a], has_movable_b(c.contact) ? b.inverse_mass[c.contact.b] : 0.0);
        const double weight = h * h * std::max(acceleration, kLeastAcceleration) / inverse_mass;
        const double share = std::min(1.0, (kGrowth * c.before.normal + kWeights * weight) / c.impulse.normal);
        const Vec3 point = b.start_rotation[c.contact.a].conjugate() * c.arm_a;
        o_memory.push_back({c.contact.a, c.contact.b, point, share * c.impulse.normal / (h * h),
                            share * c.impulse.friction / (h * h), share * c.impulse.rolling / (h * h)});
    }
}

void settle_velocities(const ContactBodies& b, double h, double threshold, std::span<const ActiveContact> contacts,
                       std::span<const uint32_t> which, std::span<const Vec3> angular_velocity,
                       std::span<Vec3> io_velocity, std::span<PieceVelocity> io_change) {
    const auto velocity_at = [&](uint32_t i, const Vec3& arm) -> Vec3 {
        const PieceVelocity& whole = io_change[b.piece[i]];
        return io_velocity[i] + whole.velocity + whole.turn.cross(lever_of(b, i)) +
               (angular_velocity[i] + whole.spin).cross(arm);
    };
    const auto push = [&](uint32_t i, const Vec3& arm, const Vec3& impulse) {
        const PushDivision d = divide_push(b, i);
        const Mat3& J = b.pieces[b.piece[i]].inverse_inertia;
        const Vec3 by_arm = J * arm.cross(impulse), by_lever = J * d.lever.cross(impulse);
        PieceVelocity& change = io_change[b.piece[i]];
        io_velocity[i] += d.own * impulse;
        change.velocity += d.whole * impulse;
        change.turn += by_arm + d.orbit_share * by_lever;
        change.spin += by_arm + by_lever;
    };
    for (const uint32_t k : which) {
        const ActiveContact& c = contacts[k];
        if (c.impulse.normal <= 0 || !(c.inverse_mass_normal > 0)) continue;
        const Vec3& n = c.contact.normal;
        const uint32_t i = c.contact.a, j = c.contact.b;
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
