#include "solver/collision/contact_response.h"

#include <algorithm>
#include <cmath>

#include "solver/collision/depenetration.h"

namespace sunder {
namespace {

constexpr double kTiny = 1e-300;
// Share of the last force that a contact starts from: between rigid things at rest, and else. More makes piles of
// deformable pieces swing (the force follows the deformation by a substep) and gives hits twice; less lets stacks
// creep.
constexpr double kRestingWarmStart = 0.9, kWarmStart = 0.5;

bool has_movable_b(const Contact& c) { return !(c.b & Contact::kStatic); }

// Rotation vector of a bound particle from the start of the substep, to second order; exact enough below a radian a
// substep.
Vec3 turned(const Quat& now, const Quat& start) {
    const Quat dq = now * start.conjugate();
    return dq.vec() * (dq.w() < 0 ? -2.0 : 2.0);
}

Vec3 turned(const ContactBodies& b, uint32_t i) {
    const ContactPiece& p = b.pieces[b.piece[i]];
    return p.rigid ? p.turn : Vec3(turned(b.moving[i].d, b.start_rotation[i]) + p.turn);
}

// Displacement of i's touching point since the start of the substep, m.
Vec3 motion_of(const ContactBodies& b, uint32_t i, const Vec3& arm, const Vec3& lever) {
    const Vec3 shift = b.moving[i].x - b.start_position[i];
    const ContactPiece& p = b.pieces[b.piece[i]];
    if (p.rigid) return shift + p.turn.cross(arm);
    return shift + turned(b.moving[i].d, b.start_rotation[i]).cross(arm) + p.shift + p.turn.cross(lever);
}

// Displacement of a's touching point less that of b's since the start of the substep, m.
Vec3 relative_motion(const ContactBodies& b, const ActiveContact& c) {
    const Vec3 motion = motion_of(b, c.contact.a, c.arm_a, c.lever_a);
    if (!has_movable_b(c.contact)) return motion - c.collider_motion;
    return motion - motion_of(b, c.contact.b, c.arm_b, c.lever_b);
}

// How a push at a touching point divides. A share s moves the particle alone, the rest its whole piece, as if rigid;
// the torque about the particle's own centre always turns the piece. Momentum comes out right for any s: soft bodies
// give where they are touched (s = 1), stiff ones go as a whole (s = 0), and shape matching finds the rest.
struct Response {
    Vec3 own, shift, turn, couple_turn;
};
Response response(const ContactBodies& b, uint32_t i, const Vec3& impulse, const Vec3& couple) {
    const ContactPiece& p = b.pieces[b.piece[i]];
    if (p.rigid) return {b.inverse_mass[i] * impulse, Vec3::Zero(), p.inverse_inertia * couple, Vec3::Zero()};
    const double s = b.own_share[i];
    const Vec3 couple_turn = p.inverse_inertia * couple;
    const Vec3 center = b.start_position[i] - p.center;
    return {s * b.inverse_mass[i] * impulse, (1 - s) * p.inverse_mass * impulse,
            couple_turn + p.inverse_inertia * ((1 - s) * center.cross(impulse)), couple_turn};
}

// What a unit impulse at the touching point moves it by, 1/kg. Where the turn of the piece takes back what the particle
// gives, a half of that is kept, so that no step overshoots by more than twice.
double inverse_mass_along(const ContactBodies& b, uint32_t i, const Vec3& arm, const Vec3& lever,
                          const Vec3& direction) {
    if (b.inverse_mass[i] == 0) return 0;
    const Response r = response(b, i, direction, arm.cross(direction));
    const double straight = direction.dot(r.own + r.shift);
    return straight + std::max(lever.cross(direction).dot(r.turn), -0.5 * straight);
}

double inverse_mass_along(const ContactBodies& b, const ActiveContact& c, const Vec3& direction) {
    double w = inverse_mass_along(b, c.contact.a, c.arm_a, c.lever_a, direction);
    if (has_movable_b(c.contact)) w += inverse_mass_along(b, c.contact.b, c.arm_b, c.lever_b, direction);
    return w;
}

// Applies an impulse (mass times displacement) and an angular impulse to one side.
void push_one(const ContactBodies& b, uint32_t i, const Vec3& impulse, const Vec3& angular_impulse) {
    if (b.inverse_mass[i] == 0) return;
    const Response r = response(b, i, impulse, angular_impulse);
    const Vec3 shift = b.inverse_mass[i] * impulse;
    b.moving[i].x += r.own;
    b.moving[i].x_inertial += shift;
    b.push[i].shift += shift;
    b.push[i].torque += angular_impulse;
    ContactPiece& p = b.pieces[b.piece[i]];
    p.shift += r.shift;
    p.turn += r.turn;
    p.couple_turn += r.couple_turn;
}

void push_both(const ContactBodies& b, const ActiveContact& c, const Vec3& impulse) {
    push_one(b, c.contact.a, impulse, c.arm_a.cross(impulse));
    if (has_movable_b(c.contact)) push_one(b, c.contact.b, -impulse, -c.arm_b.cross(impulse));
}

// Moves `io_total` by `change`, but not beyond length `limit`; returns the change that was made.
Vec3 change_within(Vec3& io_total, const Vec3& change, double limit) {
    const Vec3 before = io_total;
    io_total += change;
    if (const double size = io_total.norm(); size > limit) io_total *= limit / std::max(size, kTiny);
    return io_total - before;
}

void rub(const ContactBodies& b, ActiveContact& c) {
    const Vec3& n = c.contact.normal;
    const double limit = c.friction * c.normal_impulse;
    if (limit <= 0 && c.friction_impulse.isZero(0)) return;
    const Vec3 motion = relative_motion(b, c);
    const Vec3 slip = motion - n * n.dot(motion);
    const double length = slip.norm();
    const Vec3 direction = length > kTiny ? Vec3(slip / length) : Vec3::Zero();
    const double w = length > kTiny ? inverse_mass_along(b, c, direction) : 1.0;
    if (!(w > 0)) return;
    push_both(b, c, change_within(c.friction_impulse, -slip / w, limit));
}

void resist_rolling(const ContactBodies& b, ActiveContact& c) {
    if (c.rolling_arm <= 0) return;
    const uint32_t i = c.contact.a, j = c.contact.b;
    const bool movable = has_movable_b(c.contact);
    Vec3 rolled = turned(b, i);
    if (movable) rolled -= turned(b, j);
    const double length = rolled.norm();
    const Vec3 axis = length > kTiny ? Vec3(rolled / length) : Vec3::Zero();
    double w = axis.dot(b.pieces[b.piece[i]].inverse_inertia * axis);
    if (movable) w += axis.dot(b.pieces[b.piece[j]].inverse_inertia * axis);
    const Vec3 wanted = w > 0 ? Vec3(-rolled / w) : Vec3::Zero();
    const Vec3 change = change_within(c.rolling_impulse, wanted, c.rolling_arm * c.normal_impulse);
    push_one(b, i, Vec3::Zero(), change);
    if (movable) push_one(b, j, Vec3::Zero(), -change);
}

}  // namespace

void prepare_contacts(const ContactBodies& b, std::span<const Vec3> velocity, std::span<const Vec3> angular_velocity,
                      double h, double recovery_speed, std::span<ActiveContact> io_contacts) {
    for (ActiveContact& c : io_contacts) {
        const uint32_t i = c.contact.a;
        c.arm_a = c.contact.point_a - b.start_position[i];
        c.lever_a = c.contact.point_a - b.pieces[b.piece[i]].center;
        Vec3 approach = velocity[i] + angular_velocity[i].cross(c.arm_a);
        if (has_movable_b(c.contact)) {
            const uint32_t j = c.contact.b;
            c.arm_b = c.contact.point_b - b.start_position[j];
            c.lever_b = c.contact.point_b - b.pieces[b.piece[j]].center;
            approach -= velocity[j] + angular_velocity[j].cross(c.arm_b);
        } else {
            c.arm_b = c.lever_b = Vec3::Zero();
            approach -= c.collider_motion / h;
        }
        c.approach_speed = -c.contact.normal.dot(approach);
        const double overlap = c.allowed_gap - c.contact.gap;
        c.recovery = c.separate_pieces && overlap > 0 ? std::min(0.2 * overlap, recovery_speed * h) : 0.0;
    }
    agree_on_recovery(b, io_contacts);
}

void weigh_contacts(const ContactBodies& b, std::span<ActiveContact> io_contacts) {
    for (ActiveContact& c : io_contacts) c.inverse_mass_normal = inverse_mass_along(b, c, c.contact.normal);
}

namespace {

bool is_rigid(const ContactBodies& b, const ActiveContact& c) {
    return b.pieces[b.piece[c.contact.a]].rigid && (!has_movable_b(c.contact) || b.pieces[b.piece[c.contact.b]].rigid);
}

}  // namespace

void warm_start(const ContactBodies& b, std::span<const ContactMemory> memory, double h, double resting,
                std::span<ActiveContact> io_contacts) {
    size_t first = 0;
    for (ActiveContact& c : io_contacts) {
        if (!(c.inverse_mass_normal > 0) || c.wanted_gap <= -kLetPass) continue;
        const auto key = std::pair(c.contact.a, c.contact.b);
        while (first < memory.size() && std::pair(memory[first].a, memory[first].b) < key) ++first;
        // Of the points that this pair had, the nearest, if it moved by less than a tenth of its arm.
        const Vec3 point = b.start_rotation[c.contact.a].conjugate() * c.arm_a;
        const ContactMemory* nearest = nullptr;
        double least = 0.1 * point.norm();
        for (size_t k = first; k < memory.size() && std::pair(memory[k].a, memory[k].b) == key; ++k)
            if (const double d = (memory[k].point - point).norm(); d <= least) least = d, nearest = &memory[k];
        if (!nearest) continue;
        const Vec3& n = c.contact.normal;
        const double share =
            std::abs(c.approach_speed) <= resting && is_rigid(b, c) && !c.has_hinges ? kRestingWarmStart : kWarmStart;
        c.normal_impulse = share * h * h * nearest->normal_force;
        c.friction_impulse = share * h * h * (nearest->friction_force - n * n.dot(nearest->friction_force));
        push_both(b, c, c.normal_impulse * n + c.friction_impulse);
    }
}

void remember(const ContactBodies& b, std::span<const ActiveContact> contacts, double h,
              std::vector<ContactMemory>& o_memory) {
    o_memory.clear();
    for (const ActiveContact& c : contacts) {
        if (c.normal_impulse <= 0) continue;
        const Vec3 point = b.start_rotation[c.contact.a].conjugate() * c.arm_a;
        o_memory.push_back({c.contact.a, c.contact.b, point, c.normal_impulse / (h * h), c.friction_impulse / (h * h)});
    }
}

double solve_contact(const ContactBodies& b, ActiveContact& c) {
    if (!(c.inverse_mass_normal > 0)) return 0;
    const Vec3& n = c.contact.normal;
    const double gap = c.contact.gap + n.dot(relative_motion(b, c));
    const double impulse = std::max(c.normal_impulse + (c.wanted_gap - gap) / c.inverse_mass_normal, 0.0);
    const double change = impulse - c.normal_impulse;
    c.normal_impulse = impulse;
    if (change != 0) push_both(b, c, change * n);
    rub(b, c);
    resist_rolling(b, c);
    return std::abs(change) * c.inverse_mass_normal;
}

void add_impulses(const ContactBodies& b, double normal, const Vec3& friction, const Vec3& rolling, ActiveContact& c) {
    if (!(c.inverse_mass_normal > 0)) return;
    c.normal_impulse += normal, c.friction_impulse += friction, c.rolling_impulse += rolling;
    push_both(b, c, normal * c.contact.normal + friction);
    if (rolling.isZero(0)) return;
    push_one(b, c.contact.a, Vec3::Zero(), rolling);
    if (has_movable_b(c.contact)) push_one(b, c.contact.b, Vec3::Zero(), -rolling);
}

void settle_velocities(const ContactBodies& b, double h, double threshold, std::span<const ActiveContact> contacts,
                       std::span<const Vec3> angular_velocity, std::span<Vec3> io_velocity,
                       std::span<PieceVelocity> o_change) {
    std::fill(o_change.begin(), o_change.end(), PieceVelocity());
    const auto velocity_at = [&](uint32_t i, const Vec3& arm, const Vec3& lever) -> Vec3 {
        const PieceVelocity& whole = o_change[b.piece[i]];
        return io_velocity[i] + angular_velocity[i].cross(arm) + whole.velocity + whole.spin.cross(lever);
    };
    const auto push = [&](uint32_t i, const Vec3& arm, const Vec3& impulse) {
        if (b.inverse_mass[i] == 0) return;
        const Response r = response(b, i, impulse, arm.cross(impulse));
        io_velocity[i] += r.own;
        o_change[b.piece[i]].velocity += r.shift;
        o_change[b.piece[i]].spin += r.turn;
    };
    for (const ActiveContact& c : contacts) {
        if (c.normal_impulse <= 0 || !(c.inverse_mass_normal > 0)) continue;
        const Vec3& n = c.contact.normal;
        const uint32_t i = c.contact.a, j = c.contact.b;
        const bool movable = has_movable_b(c.contact);
        const Vec3 other = movable ? velocity_at(j, c.arm_b, c.lever_b) : Vec3(c.collider_motion / h);
        const double speed = n.dot(velocity_at(i, c.arm_a, c.lever_a) - other);
        const double bounce = c.approach_speed > threshold ? c.restitution * c.approach_speed : 0.0;
        double change = bounce > 0 ? std::max(bounce - speed, 0.0) : 0.0;
        if (speed > bounce) change = -std::min(speed - bounce, c.recovery / h);
        if (change == 0) continue;
        const Vec3 impulse = change / c.inverse_mass_normal * n;
        push(i, c.arm_a, impulse);
        if (movable) push(j, c.arm_b, -impulse);
    }
}

}  // namespace sunder
