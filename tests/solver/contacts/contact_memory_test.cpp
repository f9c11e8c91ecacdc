#include "solver/contacts/memory/contact_memory.h"

#include <gtest/gtest.h>

#include "solver/contacts/solve/depenetration.h"

namespace sunder {
namespace {

// A load that stays is remembered whole after some substeps, also where nothing has weight; of a hit no more than what
// gravity could have made of what was there.
TEST(contact_memory, a_load_lasts_and_a_hit_does_not) {
    const double h = 0.01, g = 9.81, heavy = 50, light = 0.2;  // s, m/s2, kg
    const std::vector<double> inverse_mass = {1 / heavy, 1 / light};
    const std::vector<PieceId> piece = {PieceId(0), PieceId(1)};
    const std::vector<Vec3> start = {Vec3::Zero(), Vec3::UnitX()};
    const std::vector<Quat> rotation(2, Quat::Identity());
    const std::vector<MovingParticle> moving(2);
    std::vector<ContactPiece> pieces(2);
    const ContactBodies bodies{inverse_mass, piece, start, rotation, moving, pieces};
    std::vector<ActiveContact> contacts(1);
    ActiveContact& c = contacts[0];
    c.contact.a = MovableId(0), c.contact.b = MovableId(1), c.contact.normal = Vec3::UnitZ(), c.arm_a = Vec3(0, 0, 0.1);
    std::vector<ContactMemory> memory;
    // The share that is remembered of a force, as a number of the lighter thing's weights, substep by substep.
    const auto shares = [&](double weights, double acceleration, int substeps) {
        std::vector<double> out;
        memory.clear();
        const double force = weights * light * g;
        for (int k = 0; k < substeps; ++k) {
            c.before = c.impulse = ContactImpulse();
            warm_start(bodies, memory, h, 1, contacts);
            c.impulse.normal = h * h * force, c.impulse.friction = 0.5 * h * h * force * Vec3::UnitX();
            remember(bodies, contacts, h, acceleration, memory);
            out.push_back(memory[0].normal_force / force);
            EXPECT_NEAR(memory[0].friction_force.x(), 0.5 * memory[0].normal_force, 1e-12 * force);
        }
        return out;
    };
    EXPECT_NEAR(shares(5, g, 1)[0], 1, 1e-12);  // what lies on it, five times its weight
    const std::vector<double> hit = shares(1000, g, 16);
    EXPECT_NEAR(hit[0], 0.01, 1e-12);
    EXPECT_NEAR(hit[1], 0.025, 1e-12);
    EXPECT_NEAR(hit[15], 1, 1e-12);
    EXPECT_NEAR(shares(1000, 0, 16)[15], 1, 1e-12);  // a press, where nothing has weight
}

// Heaps of loose fragments have nothing left to do then where they rest; in soft columns it would feed their sway.
TEST(contact_memory, a_torque_against_rolling_lasts_where_something_turns_as_a_whole) {
    const double h = 0.01;
    const std::vector<double> inverse_mass = {1, 1};
    const std::vector<PieceId> piece = {PieceId(0), PieceId(1)};
    const std::vector<Vec3> start = {Vec3::Zero(), Vec3::UnitX()};
    const std::vector<Quat> rotation(2, Quat::Identity());
    const std::vector<MovingParticle> moving(2);
    const Vec3 torque(0.1, -0.2, 0.3);
    for (const bool one : {false, true}) {
        std::vector<ContactPiece> pieces(2);
        pieces[1].rigid = one;
        const ContactBodies bodies{inverse_mass, piece, start, rotation, moving, pieces};
        std::vector<ActiveContact> contacts(1);
        ActiveContact& c = contacts[0];
        c.contact.a = MovableId(0), c.contact.b = MovableId(1), c.arm_a = Vec3(0, 0, 0.1);
        c.impulse.normal = h * h * 5, c.impulse.rolling = h * h * torque;
        std::vector<ContactMemory> memory;
        remember(bodies, contacts, h, 9.81, memory);
        ASSERT_EQ(memory.size(), 1u);
        EXPECT_LE((memory[0].rolling_torque - torque).norm(), 1e-12);
        c.impulse = ContactImpulse();
        warm_start(bodies, memory, h, 1, contacts);
        EXPECT_LE((c.before.rolling - (one ? 1 : 0) * h * h * torque).norm(), 1e-12 * h * h);
    }
}

// A fragment of 2 kg that lies still between colliders with these normals; what it is about to move by, m.
struct Held {
    static constexpr double kStep = 0.01, kMass = 2, kGravity = 9.81;  // s, kg, m/s2
    std::vector<double> inverse_mass = {1 / kMass};
    std::vector<PieceId> piece = {PieceId(0)};
    std::vector<Vec3> start = {Vec3::Zero()};
    std::vector<Quat> rotation = {Quat::Identity()};
    std::vector<MovingParticle> moving{1};
    std::vector<ContactPiece> pieces{1};
    std::vector<ActiveContact> contacts;
    ContactIslands islands;

    explicit Held(std::initializer_list<Vec3> normals) {
        pieces[0].rigid = true, pieces[0].inverse_mass = 1 / kMass;
        pieces[0].inverse_inertia = 100 / kMass * Mat3::Identity();
        moving[0].x = -kGravity * kStep * kStep * Vec3::UnitZ();
        for (const Vec3& normal : normals) {
            ActiveContact& c = contacts.emplace_back();
            c.contact.a = MovableId(0), c.contact.b = Contact::collider(static_cast<uint32_t>(contacts.size()));
            c.contact.normal = normal.normalized(), c.arm_a = -0.1 * c.contact.normal;
        }
        find_islands(bodies(), contacts, 1, islands);
    }
    ContactBodies bodies() const { return {inverse_mass, piece, start, rotation, moving, pieces}; }
    // Of a force, what is left of it; N.
    double tempered(double force) {
        std::vector<PieceMotion> scratch(1);
        for (ActiveContact& c : contacts) c.impulse.normal = c.before.normal = kStep * kStep * force;
        temper_warm_start(bodies(), islands, IslandId(0), kStep, kGravity, scratch, contacts);
        EXPECT_TRUE(scratch[0].shift.isZero(0) && scratch[0].turn.isZero(0));
        for (const ActiveContact& c : contacts) {
            EXPECT_EQ(c.impulse.normal, contacts[0].impulse.normal);
            EXPECT_EQ(c.before.normal, c.impulse.normal);
        }
        return contacts[0].impulse.normal / (kStep * kStep);
    }
};

// What locked things in a press went off like a spring: of 1400 shots under a press in 28 something left at 8 to 570
// times the speed of what moved.
TEST(contact_memory, forces_that_no_longer_cancel_throw_nothing) {
    const double weight = Held::kMass * Held::kGravity;
    EXPECT_EQ(Held({Vec3::UnitZ()}).tempered(weight), weight);
    EXPECT_EQ(Held({Vec3::UnitZ()}).tempered(0.5 * weight), 0.5 * weight);
    EXPECT_EQ(Held({Vec3::UnitX(), -Vec3::UnitX()}).tempered(1e6 * weight), 1e6 * weight);
    // In a wedge of a degree: it slips down, which is what the walls want to stop.
    const double slope = std::sin(M_PI / 360);
    const std::initializer_list<Vec3> wedge = {Vec3(1, 0, slope), Vec3(-1, 0, slope)};
    const double holds = 0.5 * weight / (slope / std::hypot(1, slope));
    EXPECT_NEAR(Held(wedge).tempered(holds), holds, 1e-9 * holds);
    EXPECT_NEAR(Held(wedge).tempered(1000 * holds), holds, 1e-9 * holds);
    // The other way round nothing is to be stopped at all.
    EXPECT_EQ(Held({Vec3(1, 0, -slope), Vec3(-1, 0, -slope)}).tempered(1000 * holds), 0);
}

// Walls that press on a thing from two sides work its overlap off, and close on it, along a way out that is at most
// four times what they ask for; between walls that are all but opposed it stays.
struct Between {
    Held held;
    double half;  // of the angle between the normals, rad
    explicit Between(double degrees)
        : held{Vec3(std::sin(radians(degrees)), 0, std::cos(radians(degrees))),
               Vec3(-std::sin(radians(degrees)), 0, std::cos(radians(degrees)))},
          half(radians(degrees)) {}
    static double radians(double degrees) { return 0.5 * degrees * M_PI / 180; }
    // What both want of the gap, and how far that takes it out between them, m.
    double way_out() {
        agree_on_recovery(held.bodies(), held.contacts);
        EXPECT_EQ(held.contacts[0].recovery, held.contacts[1].recovery);
        return held.contacts[0].recovery / std::cos(half);
    }
};

TEST(depenetration, what_lies_between_colliders_is_not_squeezed_out) {
    const double recovery = 1e-3;  // m
    const auto way_out = [&](double degrees) {
        Between it(degrees);
        for (ActiveContact& c : it.held.contacts) c.contact.gap = -0.05, c.recovery = recovery;
        const double way = it.way_out();
        for (const ActiveContact& c : it.held.contacts) EXPECT_EQ(c.wanted_gap, -0.05 + c.recovery);
        return way / recovery;
    };
    EXPECT_NEAR(way_out(0), 1, 1e-12);
    EXPECT_NEAR(way_out(90), std::sqrt(2), 1e-12);
    EXPECT_NEAR(way_out(140), 1 / std::cos(70 * M_PI / 180), 1e-12);
    for (const double degrees : {152, 170, 179}) EXPECT_NEAR(way_out(degrees), 4, 1e-9) << degrees;
    Between opposed(180);
    for (ActiveContact& c : opposed.held.contacts) c.contact.gap = -0.05, c.recovery = recovery;
    agree_on_recovery(opposed.held.bodies(), opposed.held.contacts);
    for (const ActiveContact& c : opposed.held.contacts) EXPECT_LE(c.recovery, 1e-7 * recovery);
}

TEST(depenetration, a_press_goes_into_what_cannot_get_out) {
    const auto wants = [&](double degrees, double press, double floor, double room) {
        Between it(degrees);
        std::vector<ActiveContact>& c = it.held.contacts;
        c[0].collider_motion = press * c[0].contact.normal, c[1].collider_motion = floor * c[1].contact.normal;
        c[0].contact.gap = room;
        it.way_out();
        return std::pair(c[0].wanted_gap, c[1].wanted_gap);
    };
    using Wanted = std::pair<double, double>;
    EXPECT_EQ(wants(90, 0.01, 0, 0), Wanted(0, 0));
    EXPECT_EQ(wants(140, 0.01, 0, 0), Wanted(0, 0));
    const double share = 4 * std::cos(85 * M_PI / 180);  // of 170 degrees
    EXPECT_NEAR(wants(170, 0.01, 0, 0).first, -(1 - share) * 0.01, 1e-12);
    EXPECT_EQ(wants(170, 0.01, 0, 0).second, 0);
    EXPECT_NEAR(wants(170, 0.01, 0.01, 0).second, -(1 - share) * 0.01, 1e-12);
    EXPECT_NEAR(wants(170, 0.01, 0, 0.004).first, -(1 - share) * 0.006, 1e-12);
    EXPECT_EQ(wants(170, 0.01, 0, 0.02), Wanted(0, 0));
    EXPECT_EQ(wants(170, 0.01, -0.01, 0), Wanted(0, 0));  // both go the same way, and take it along
    EXPECT_EQ(wants(170, -0.01, 0, 0), Wanted(0, 0));
}

}  // namespace
}  // namespace sunder
