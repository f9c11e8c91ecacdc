#include "solver/collision/contact_response.h"

#include <algorithm>
#include <cmath>

namespace sunder {
namespace {

constexpr double kTiny = 1e-300;
// Share of the last force that a contact starts from. All of it makes piles of deformable pieces swing (the force
// follows the deformation by a substep); none of it lets stacks of rigid ones sink.
constexpr double kWarmStart = 0.5;

bool has_movable_b(const Contact& c) { return !(c.b & Contact::kStatic); }

// Rotation vector from the start of the substep, to second order; exact enough below a radian a substep.
Vec3 turned(const Quat& now, const Quat& start) {
    const Quat dq = now * start.conjugate();
    return dq.vec() * (dq.w() < 0 ? -2.0 : 2.0);
}

// Displacement of a's touching point less that of b's since the start of the substep, m.
Vec3 relative_motion(const ContactBodies& b, const ActiveContact& c) {
    const uint32_t i = c.contact.a;
    Vec3 motion = b.moving[i].x - b.start_position[i] + turned(b.moving[i].d, b.start_rotation[i]).cross(c.arm_a);
    if (!has_movable_b(c.contact)) return motion - c.collider_motion;
    const uint32_t j = c.contact.b;
    return motion - (b.moving[j].x - b.start_position[j] + turned(b.moving[j].d, b.start_rotation[j]).cross(c.arm_b));
}

double inverse_mass_along(const ContactMass& m, const Vec3& arm, const Vec3& direction) {
    const Vec3 lever = arm.cross(direction);
    return m.inverse_mass + lever.dot(m.inverse_inertia * lever);
}

double inverse_mass_along(const ContactBodies& b, const ActiveContact& c, const Vec3& direction) {
    double w = inverse_mass_along(b.mass[c.contact.a], c.arm_a, direction);
    if (has_movable_b(c.contact)) w += inverse_mass_along(b.mass[c.contact.b], c.arm_b, direction);
    return w;
}

void turn_by(MovingParticle& p, const Vec3& turn) {
    const Quat half(1.0, 0.5 * turn.x(), 0.5 * turn.y(), 0.5 * turn.z());
    p.d = (half * p.d).normalized();
    p.d_inertial = (half * p.d_inertial).normalized();
    p.D = p.d.toRotationMatrix();
}

// Applies an impulse (mass times displacement) and an angular impulse to one side.
void push_one(const ContactBodies& b, uint32_t i, const Vec3& impulse, const Vec3& angular_impulse) {
    const ContactMass& m = b.mass[i];
    if (m.inverse_mass == 0) return;
    const Vec3 shift = m.inverse_mass * impulse, turn = m.inverse_inertia * angular_impulse;
    MovingParticle& p = b.moving[i];
    p.x += shift;
    p.x_inertial += shift;
    if (!turn.isZero(0)) turn_by(p, turn);
    b.push[i].shift += shift;
    b.push[i].torque += angular_impulse;
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
    Vec3 rolled = turned(b.moving[i].d, b.start_rotation[i]);
    if (movable) rolled -= turned(b.moving[j].d, b.start_rotation[j]);
    const double length = rolled.norm();
    const Vec3 axis = length > kTiny ? Vec3(rolled / length) : Vec3::Zero();
    double w = axis.dot(b.mass[i].inverse_inertia * axis);
    if (movable) w += axis.dot(b.mass[j].inverse_inertia * axis);
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
        c.inverse_mass_normal = inverse_mass_along(b, c, c.contact.normal);
        const double overlap = c.allowed_gap - c.contact.gap;
        c.recovery = c.separate_pieces && overlap > 0 ? std::min(0.2 * overlap, recovery_speed * h) : 0.0;
        c.wanted_gap = std::min(c.allowed_gap, c.contact.gap + c.recovery);
    }
}

void warm_start(const ContactBodies& b, std::span<const ContactMemory> memory, double h,
                std::span<ActiveContact> io_contacts) {
    size_t first = 0;
    for (ActiveContact& c : io_contacts) {
        if (!(c.inverse_mass_normal > 0)) continue;
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
        c.normal_impulse = kWarmStart * h * h * nearest->normal_force;
        c.friction_impulse = kWarmStart * h * h * (nearest->friction_force - n * n.dot(nearest->friction_force));
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

double solve_contacts(const ContactBodies& b, std::span<ActiveContact> io_contacts) {
    double largest = 0;
    for (ActiveContact& c : io_contacts) {
        if (!(c.inverse_mass_normal > 0)) continue;
        const Vec3& n = c.contact.normal;
        const double gap = c.contact.gap + n.dot(relative_motion(b, c));
        const double impulse = std::max(c.normal_impulse + (c.wanted_gap - gap) / c.inverse_mass_normal, 0.0);
        const double change = impulse - c.normal_impulse;
        c.normal_impulse = impulse;
        largest = std::max(largest, std::abs(change) * c.inverse_mass_normal);
        if (change != 0) push_both(b, c, change * n);
        rub(b, c);
        resist_rolling(b, c);
    }
    return largest;
}

void settle_velocities(std::span<const ContactMass> mass, double h, double threshold,
                       std::span<const ActiveContact> contacts, std::span<Vec3> io_velocity,
                       std::span<Vec3> io_angular_velocity) {
    for (const ActiveContact& c : contacts) {
        if (c.normal_impulse <= 0) continue;
        const Vec3& n = c.contact.normal;
        const uint32_t i = c.contact.a, j = c.contact.b;
        const bool movable = has_movable_b(c.contact);
        Vec3 relative = io_velocity[i] + io_angular_velocity[i].cross(c.arm_a);
        relative -=
            movable ? Vec3(io_velocity[j] + io_angular_velocity[j].cross(c.arm_b)) : Vec3(c.collider_motion / h);
        const double speed = n.dot(relative);
        const double bounce = c.approach_speed > threshold ? c.restitution * c.approach_speed : 0.0;
        double change = bounce > 0 ? std::max(bounce - speed, 0.0) : 0.0;
        if (speed > bounce) change = -std::min(speed - bounce, c.recovery / h);
        if (change == 0) continue;
        const Vec3 impulse = change / c.inverse_mass_normal * n;
        io_velocity[i] += mass[i].inverse_mass * impulse;
        io_angular_velocity[i] += mass[i].inverse_inertia * c.arm_a.cross(impulse);
        if (!movable) continue;
        io_velocity[j] -= mass[j].inverse_mass * impulse;
        io_angular_velocity[j] -= mass[j].inverse_inertia * c.arm_b.cross(impulse);
    }
}

}  // namespace sunder
