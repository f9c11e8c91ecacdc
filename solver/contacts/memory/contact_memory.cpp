#include "solver/contacts/memory/contact_memory.h"

#include <algorithm>
#include <cmath>

#include "solver/contacts/solve/depenetration.h"
#include "solver/data/invariant.h"
#include "solver/scene/scales.h"

namespace sunder {
namespace {

// Share of the last force that a contact starts from: at rest, where nothing hangs on hinges, and else. More makes
// piles of broken pieces swing (the force follows the deformation by a substep) and gives hits twice; less lets stacks
// creep.
constexpr double kRestingWarmStart = 0.9, kWarmStart = 0.5;
// Of its arm, by how much a touching point may have moved and still be the one that it was.
constexpr double kSamePoint = 0.1;
// A force lasts as at most so many times what lasted of it before, and so many weights of the lighter thing; where
// there is no gravity, as if there was some.
constexpr double kGrowth = 1.5, kWeights = 10, kLeastAcceleration = 1;  // -, -, m/s2

// A particle of a soft piece does not: what it hangs on turns it back, and with remembered torques soft columns sway.
bool turns_as_a_whole(const ContactBodies& b, const Contact& c) {
    return b.pieces[b.piece[c.a]].rigid || (has_movable_b(c) && b.pieces[b.piece[c.b]].rigid);
}

// Of a touching point since the start of the substep, m.
Vec3 motion_at(const ContactBodies& b, MovableId i, const Vec3& arm) {
    return b.moving[i].x - b.start_position[i] + turned(b, i).cross(arm);
}

Vec3 force_of(const ActiveContact& c) { return c.impulse.normal * c.contact.normal + c.impulse.friction; }

// The product of a contact's impulses with what it wants them to do, kg m2.
double wanted_work(const ContactBodies& b, const ActiveContact& c) {
    Vec3 motion = motion_at(b, c.contact.a, c.arm_a) - c.collider_motion, rolled = turned(b, c.contact.a);
    if (has_movable_b(c.contact)) {
        motion -= motion_at(b, c.contact.b, c.arm_b);
        rolled -= turned(b, c.contact.b);
    }
    return c.impulse.normal * (c.wanted_gap - c.contact.gap) - force_of(c).dot(motion) - c.impulse.rolling.dot(rolled);
}

}  // namespace

void warm_start(const ContactBodies& b, std::span<const ContactMemory> memory, double h, double resting,
                std::span<ActiveContact> io_contacts) {
    const auto pair_of = [](const auto& c) { return std::pair(c.a, c.b); };
    SUNDER_ASSERT(h > 0 && resting >= 0);
    if (io_contacts.empty()) return;
    auto first = static_cast<size_t>(
        std::ranges::lower_bound(memory, pair_of(io_contacts.front().contact), {}, pair_of) - memory.begin());
    for (ActiveContact& c : io_contacts) {
        const bool movable =
            b.inverse_mass[c.contact.a] > 0 || (has_movable_b(c.contact) && b.inverse_mass[c.contact.b] > 0);
        if (!movable || c.wanted_gap <= -kLetPass) continue;
        const auto key = pair_of(c.contact);
        while (first < memory.size() && pair_of(memory[first]) < key) ++first;
        // Of the points that this pair had, the nearest.
        const Vec3 point = b.start_rotation[c.contact.a].conjugate() * c.arm_a;
        const ContactMemory* nearest = nullptr;
        double least = kSamePoint * point.norm();
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

void temper_warm_start(const ContactBodies& b, const ContactIslands& islands, IslandId island, double h,
                       double acceleration, std::span<PieceMotion> io_motion, std::span<ActiveContact> io_contacts) {
    SUNDER_ASSERT(h > 0 && island < islands.size() && io_motion.size() == b.pieces.size());
    const auto push = [&](MovableId i, const Vec3& arm, const Vec3& impulse, const Vec3& couple) {
        PieceMotion& p = io_motion[b.piece[i]];
        p.shift += impulse;
        p.turn += (lever_of(b, i) + arm).cross(impulse) + couple;
    };
    const auto each = [&](const auto& body) {
        for (const ContactId k : islands.contacts_of(island))
            if (io_contacts[k].impulse.normal > 0) body(io_contacts[k]);
    };
    each([&](const ActiveContact& c) {
        push(c.contact.a, c.arm_a, force_of(c), c.impulse.rolling);
        if (has_movable_b(c.contact)) push(c.contact.b, c.arm_b, -force_of(c), -c.impulse.rolling);
    });
    // Twice the energies, times the square of the substep, kg m2.
    double given = 0, there = 0;
    for (const PieceId p : islands.pieces_of(island)) {
        PieceMotion& sum = io_motion[p];
        given +=
            b.pieces[p].inverse_mass * sum.shift.squaredNorm() + sum.turn.dot(b.pieces[p].inverse_inertia * sum.turn);
        sum = PieceMotion();
    }
    const double fall = fall_in_step(h, std::max(acceleration, kLeastAcceleration));
    for (const MovableId i : islands.movables_of(island))
        if (b.inverse_mass[i] > 0)
            there += ((b.moving[i].x - b.start_position[i]).squaredNorm() + fall * fall) / b.inverse_mass[i];
    if (given <= there) return;
    double wanted = 0;
    each([&](const ActiveContact& c) { wanted += wanted_work(b, c); });
    if (given <= wanted) return;
    const double share = std::max(wanted, 0.0) / given;
    each([&](ActiveContact& c) { c.impulse = share * c.impulse, c.before = share * c.before; });
}

void remember(const ContactBodies& b, std::span<const ActiveContact> contacts, double h, double acceleration,
              std::vector<ContactMemory>& o_memory) {
    o_memory.clear();
    SUNDER_ASSERT(h > 0 && acceleration >= 0);
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

}  // namespace sunder
