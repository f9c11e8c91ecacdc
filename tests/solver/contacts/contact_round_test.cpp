#include "solver/contacts/solve/contact_round.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

namespace sunder {
namespace {

// Metres and kilograms, or others.
struct Scale {
    double length = 1, mass = 1;
};

// A piece of four bound particles, a lone fragment, and four contacts among them and with a floor.
struct Touching {
    std::vector<double> inverse_mass = {2, 2, 2, 2, 5};
    std::vector<PieceId> piece = {PieceId(0), PieceId(0), PieceId(0), PieceId(0), PieceId(1)};
    std::vector<Vec3> start = {{0, 0, 0}, {1, 0.1, 0}, {0.2, 1, 0.3}, {0, 0.2, 1}, {1.5, 1, 1}};
    std::vector<Quat> rotation = std::vector<Quat>(5, Quat::Identity());
    std::vector<MovingParticle> moving;
    std::vector<ContactPiece> pieces = std::vector<ContactPiece>(2);
    std::vector<ActiveContact> contacts = std::vector<ActiveContact>(4);
    ContactIslands islands;
    std::vector<RoundPush> given = std::vector<RoundPush>(5);  // as the islands' movables
    std::vector<PieceMotion> motion = std::vector<PieceMotion>(2);
    std::vector<double> brace = std::vector<double>(5);
    double length = 0.01;  // m

    explicit Touching(double own_share, Scale scale = {}) {
        Mat3 inertia = 0.05 * Mat3::Identity();
        for (int i = 0; i < 4; ++i) pieces[0].center += start[i] / 4;
        for (int i = 0; i < 4; ++i) {
            const Vec3 r = start[i] - pieces[0].center;
            inertia += 0.5 * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
        }
        pieces[0].inverse_mass = 0.5;
        pieces[0].inverse_inertia = inertia.inverse();
        pieces[0].own_share = own_share;
        pieces[1].center = start[4];
        pieces[1].inverse_mass = 5;
        pieces[1].inverse_inertia = Vec3(9, 7, 5).asDiagonal();
        pieces[1].rigid = true;
        const uint32_t floor = Contact::kStatic, sides[4][2] = {{0, floor}, {1, 4}, {2, floor}, {4, 3}};
        for (int k = 0; k < 4; ++k) {
            ActiveContact& c = contacts[k];
            c.contact.a = MovableId(sides[k][0]), c.contact.b = MovableId(sides[k][1]);
            c.contact.normal = Vec3(0.3 * k - 0.4, 0.2, 1 - 0.3 * k).normalized();
            c.arm_a = Vec3(0.1, -0.2 + 0.1 * k, 0.15);
            if (c.contact.b != floor) c.arm_b = Vec3(-0.1, 0.05 * k, 0.2);
        }
        measure_in(scale);
        for (const Vec3& x : start) moving.push_back({x, Quat::Identity(), x, Quat::Identity()});
        find_islands(bodies(), contacts, 1, islands);
    }
    // Overlap, slip against the floor and something to roll on, so that all impulses have work to do.
    void press() {
        for (ActiveContact& c : contacts) {
            c.contact.gap = -0.3 * length, c.friction = 0.4, c.rolling_arm = 3 * length;
            if (!has_movable_b(c.contact)) c.collider_motion = length * Vec3(0.2, -0.1, 0);
        }
    }
    void solve() {
        ContactRound round;
        begin(round, ContactRound::Which::first);
        for (IslandId n(0); n < islands.size(); ++n) round.relax(n, 1e-4 * length);
        end(round);
        hand_over(round);
    }
    void begin(ContactRound& round, ContactRound::Which which) {
        round.open(bodies(), islands, which, length, contacts);
        for (IslandId n(0); n < islands.size(); ++n) round.take_up(n);
        round.lay_out();
        for (IslandId n(0); n < islands.size(); ++n) round.start(n);
    }
    void end(ContactRound& round) {
        for (IslandId n(0); n < islands.size(); ++n) round.end(n, given, motion, brace);
    }
    void hand_over(const ContactRound& round) {
        for (IslandId n(0); n < islands.size(); ++n) round.hand_over(n, contacts);
    }
    ContactBodies bodies() { return {inverse_mass, piece, start, rotation, moving, pieces}; }

private:
    void measure_in(Scale scale) {
        length *= scale.length;
        for (double& w : inverse_mass) w /= scale.mass;
        for (Vec3& x : start) x *= scale.length;
        for (ContactPiece& p : pieces) {
            p.center *= scale.length, p.inverse_mass /= scale.mass;
            p.inverse_inertia /= scale.mass * scale.length * scale.length;
        }
        for (ActiveContact& c : contacts) c.arm_a *= scale.length, c.arm_b *= scale.length;
    }
};

// What passes over the contacts need to converge: a push at one contact moves another by what one there moves this by,
// and the weight that divides a push is the motion that the push has. To some roundings of single precision (6e-8).
TEST(contact_round, the_response_to_pushes_is_symmetric_and_what_they_are_divided_by) {
    for (double share : {0.0, 0.3, 1.0}) {
        Eigen::Matrix4d W;
        for (int k = 0; k < 4; ++k) {
            Touching t(share);
            ContactRound round;
            t.contacts[t.islands.contact[k]].impulse.normal = 1;
            t.begin(round, ContactRound::Which::first);
            for (int j = 0; j < 4; ++j) W(j, k) = t.contacts[t.islands.contact[j]].contact.normal.dot(round.motion(j));
            t.hand_over(round);
            EXPECT_NEAR(W(k, k), t.contacts[t.islands.contact[k]].inverse_mass_normal, 1e-6 * W(k, k));
        }
        EXPECT_LE((W - W.transpose()).norm(), 1e-6 * W.norm()) << "share " << share << "\n" << W;
        EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(W).eigenvalues().minCoeff(), 0);
    }
}

// The last round starts from no less than what contacts had a substep ago, and has moved things by it; what is within a
// piece is left alone.
TEST(contact_round, the_last_starts_from_the_forces_of_before) {
    constexpr double kHad = 0.25, kBefore = 1;  // impulses, kg m
    const auto begin_last = [](Touching& t, ContactRound& round, double impulse, double before) {
        for (ActiveContact& c : t.contacts) {
            c.impulse.normal = impulse, c.before.normal = before;
            c.contact.gap = 1;  // nothing for passes to do but to take it off again
        }
        t.begin(round, ContactRound::Which::first);
        t.end(round);
        std::ranges::fill(t.motion, PieceMotion());
        t.begin(round, ContactRound::Which::last);
    };
    for (const double before : {0.0, 0.5 * kHad}) {
        Touching t(0.3);
        ContactRound round;
        begin_last(t, round, kHad, before);
        for (size_t k = 0; k < t.contacts.size(); ++k) EXPECT_TRUE(round.motion(k).isZero(0));
    }
    Touching t(0.3), plain(0.3), within(0.3);
    ContactRound round, same, left_alone;
    begin_last(t, round, kHad, kBefore);
    for (ActiveContact& c : plain.contacts) c.impulse.normal = kBefore - kHad;
    plain.begin(same, ContactRound::Which::first);
    for (size_t k = 0; k < t.contacts.size(); ++k) {
        const Vec3 expected = same.motion(k);
        EXPECT_GT(expected.norm(), 0);
        EXPECT_LE((round.motion(k) - expected).norm(), 1e-6 * expected.norm()) << "contact " << k;
    }
    t.end(round);
    t.hand_over(round);
    for (const ActiveContact& c : t.contacts) EXPECT_EQ(c.impulse.normal, kBefore);

    for (ActiveContact& c : within.contacts) c.separate_pieces = false;
    begin_last(within, left_alone, kHad, kBefore);
    within.end(left_alone);
    within.hand_over(left_alone);
    for (const ActiveContact& c : within.contacts) EXPECT_EQ(c.impulse.normal, kHad);
    for (const RoundPush& push : within.given) EXPECT_TRUE(push.shift.isZero(0));
}

// As hard as the round took it to resist a push, less its own inertia, and only while shape matching follows.
TEST(contact_round, braces_what_it_pushes_until_the_last) {
    for (double share : {0.01, 0.3, 1.0}) {
        Touching t(share);
        t.press();
        ContactRound round;
        for (const auto which : {ContactRound::Which::first, ContactRound::Which::between, ContactRound::Which::last}) {
            t.begin(round, which);
            for (IslandId n(0); n < t.islands.size(); ++n) round.relax(n, 1e-4 * t.length);
            t.end(round);
            t.hand_over(round);
            for (uint32_t i = 0; i < t.brace.size(); ++i) {
                const auto touches = [&](const ActiveContact& c) {
                    return c.impulse.normal > 0 && (c.contact.a == i || c.contact.b == i);
                };
                const bool pushed = std::ranges::any_of(t.contacts, touches) && which != ContactRound::Which::last;
                const PushDivision d = divide_push(t.bodies(), i);
                const double expected = pushed ? 3 * (t.inverse_mass[i] / (d.own + d.whole) - 1) : 0;
                EXPECT_NEAR(t.brace[i], expected, 1e-12 * (1 + expected)) << "movable " << i << ", share " << share;
            }
            std::ranges::fill(t.motion, PieceMotion());
        }
    }
}

// Passes are in single precision; what they give is not.
TEST(contact_round, pushes_are_equal_and_opposite_to_the_last_digits) {
    for (double share : {0.0, 0.3, 1.0}) {
        Touching t(share);
        t.press();
        t.solve();
        Vec3 linear = Vec3::Zero(), angular = Vec3::Zero(), moved = Vec3::Zero();
        double size = 0;
        for (size_t k = 0; k < t.given.size(); ++k) {
            const RoundPush& given = t.given[k];
            const uint32_t i = t.islands.movable[k];
            linear += given.shift / t.inverse_mass[i];
            angular += t.start[i].cross(given.shift / t.inverse_mass[i]) + given.torque;
            moved += given.own / t.inverse_mass[i];
        }
        for (size_t p = 0; p < t.pieces.size(); ++p) moved += t.motion[p].shift / t.pieces[p].inverse_mass;
        Vec3 floor = Vec3::Zero(), couple = Vec3::Zero();  // what the contacts say
        for (const ActiveContact& c : t.contacts) {
            const Vec3 f = c.impulse.normal * c.contact.normal + c.impulse.friction;
            size += f.norm();
            couple += (t.start[c.contact.a] + c.arm_a).cross(f);
            if (has_movable_b(c.contact))
                couple -= (t.start[c.contact.b] + c.arm_b).cross(f);
            else
                floor += f, couple += c.impulse.rolling;
        }
        EXPECT_GT(size, 0);
        EXPECT_LE((linear - floor).norm(), 1e-14 * size);
        EXPECT_LE((moved - floor).norm(), 1e-14 * size);
        EXPECT_LE((angular - couple).norm(), 1e-14 * size);  // arms of about a metre
    }
}

// Dust and moons: numbers of a round are in units of what it is about, and squares of an inverse inertia in range.
TEST(contact_round, is_the_same_to_the_last_bit_for_small_and_large_things) {
    Touching plain(0.3);
    plain.press();
    plain.solve();
    for (const Scale scale : {Scale{std::ldexp(1.0, -20), std::ldexp(1.0, -60)}, Scale{1024, std::ldexp(1.0, 60)}}) {
        Touching t(0.3, scale);
        t.press();
        t.solve();
        for (size_t k = 0; k < t.contacts.size(); ++k) {
            const ContactImpulse &p = plain.contacts[k].impulse, &q = t.contacts[k].impulse;
            EXPECT_EQ(q.normal, scale.length * scale.mass * p.normal);
            EXPECT_EQ(q.friction, Vec3(scale.length * scale.mass * p.friction));
            EXPECT_EQ(q.rolling, Vec3(scale.length * scale.length * scale.mass * p.rolling));
        }
    }
    EXPECT_GT(plain.contacts[0].impulse.normal, 0);
    EXPECT_GT(plain.contacts[0].impulse.friction.norm(), 0);
    EXPECT_GT(plain.contacts[0].impulse.rolling.norm(), 0);
}

}  // namespace
}  // namespace sunder
