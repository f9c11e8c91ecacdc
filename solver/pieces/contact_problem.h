// The contacts of a step, and what solves them.
#pragma once

#include <vector>

#include "solver/contacts/solve/contact_round.h"

namespace sunder {

/// A contact at which a load, or ground, presses on a particle of a piece that gives. A load is a lone fragment or a
/// rigid body that one such piece holds up, and nothing else that gives, nor ground; where it is driven in, ground that
/// does not squeeze it may touch it. Ground is what nothing moves: a collider, a sleeper.
struct Bearing {
    enum class Of : uint8_t { nothing, load, ground };
    Of of = Of::nothing;
    bool of_a = true;           // the particle is the contact's a
    double mass = 0;            // of what presses, its share; 0: it does not press, kg
    Vec3 given = Vec3::Zero();  // in a Newton step, to the contact's a, kg m
};

/// The loads of a substep.
struct StandingLoads {
    enum class How : uint8_t {
        not_at_all,
        kept,      // contacts start from a part of their last forces
        together,  // likewise, but bearings start from nothing: what presses there is matched with what bears it
        driven     // bearings as there, which rounds push as well; all else as where nothing stands
    };
    struct OfMovable {
        double pressure = 0;           // of its bearings, kg m
        Vec3 held_up = Vec3::Zero();   // by them, kg m
        Vec3 grounded = Vec3::Zero();  // by ground, kg m
        double pull = 0;               // of their particles' groups on these, kg
        PieceId on;                    // the piece that bears it
        bool is_load = true;
        double resists = 0;             // of a load, the mass that its bearings meet in all, kg
        double mass = 0, ground = 0;    // of what presses on it, and of that ground's, kg
        Vec3 begin = Vec3::Zero();      // where it is before shape matching, m
        Vec3 to_ground = Vec3::Zero();  // times `ground`, kg m
        Vec3 impulse = Vec3::Zero();    // kg m
        Vec3 torque = Vec3::Zero();     // times the substep, kg m2
        Mat3 inertia = Mat3::Zero();    // of the masses of its bearings about it, kg m2
        double work = 0, share = 1;     // of its bearings, kg m2; of what they give, what it takes
    };
    struct OfPiece {
        Vec3 by_loads = Vec3::Zero(), by_ground = Vec3::Zero();  // impulses, kg m
        double share = 1;                                        // of by_ground that it takes
    };
    std::vector<How> how;             // (n_islands)
    std::vector<int> newton_steps;    // a substep takes so many at least (n_islands)
    std::vector<Bearing> bearings;    // as the islands' contacts
    std::vector<OfMovable> movables;  // as the islands' movables
    std::vector<OfPiece> pieces;      // as the islands' pieces

    bool are_matched(IslandId island) const { return how[island] == How::together || how[island] == How::driven; }

    /// Makes room; nothing stands yet.
    void open(const ContactIslands& islands);
};

struct ContactProblem {
    std::vector<ActiveContact> contacts;
    ContactIslands islands;  // of `contacts`
    ContactRound round;
    StandingLoads loads;
    std::vector<RoundPush> pushes;  // of the last round (as the islands' movables)
    std::vector<double> brace;      // of what contacts push, while it is matched (n_movables)

    bool pushes_anything() const {
        return std::ranges::any_of(contacts, [](const ActiveContact& c) { return c.impulse.normal > 0; });
    }
    /// What the last round gave to a movable; zero where nothing touches it.
    const RoundPush& push_on(MovableIndex movable) const {
        static const RoundPush none;
        const uint32_t slot = islands.movable_slot[movable];
        return slot == kNone ? none : pushes[slot];
    }
};

}  // namespace sunder
