// Contacts on positions: no overlap, Coulomb friction, rolling resistance, restitution. Overlap that was there before
// is worked off slowly and without giving speed.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/contact.h"
#include "solver/data/frame_state.h"
#include "solver/shape_matching.h"

namespace sunder {

/// What moves as a whole: a piece (a lone fragment is one) or a rigid body.
struct ContactPiece {
    Vec3 center = Vec3::Zero();           // of mass, at the start of the substep, m
    double inverse_mass = 0;              // 1/kg; held: 0
    Mat3 inverse_inertia = Mat3::Zero();  // about the centre, world, at the start of the substep, 1/(kg m2); held: 0
    bool rigid = false;                   // a lone fragment or a rigid body: nothing in it gives
    bool unbroken = false;                // every edge of its particles is intact: it has no hinges
    // What contacts moved the whole by and did not yet hand on to its particles; a rigid thing's `turn` is all of its
    // turning through the substep.
    Vec3 shift = Vec3::Zero();        // m
    Vec3 turn = Vec3::Zero();         // rad
    Vec3 couple_turn = Vec3::Zero();  // the part of `turn` due to torques about the particles' own centres
};

/// What contacts did to a movable thing in this substep, for the momentum books.
struct ContactPush {
    Vec3 shift = Vec3::Zero();   // m
    Vec3 torque = Vec3::Zero();  // angular impulse times the substep, kg m2
};

/// A contact with its running impulses (in kg m: mass times displacement).
struct ActiveContact {
    Contact contact;
    Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();      // from the centres to the touching points, m
    Vec3 lever_a = Vec3::Zero(), lever_b = Vec3::Zero();  // the same from the centres of what turns, m
    Vec3 collider_motion = Vec3::Zero();                  // of point_b over the substep where b is a collider, m
    double allowed_gap = 0;                               // overlap at rest of two fragments of one body, <= 0, m
    double friction = 0, restitution = 0;
    double rolling_arm = 0;          // resistance to rolling: torque = rolling_arm * normal force, m
    bool separate_pieces = true;     // overlap is worked off only between separate pieces
    bool has_hinges = false;         // its island has a piece that is partly broken
    double wanted_gap = 0;           // at the end of the substep, m
    double recovery = 0;             // part of it that works off old overlap, m
    double inverse_mass_normal = 0;  // 1/kg
    double approach_speed = 0;       // along the normal before the step, m/s
    double normal_impulse = 0;
    Vec3 friction_impulse = Vec3::Zero(), rolling_impulse = Vec3::Zero();
};

/// The movable things of a step, indexed as Contact does: where they were and where they are.
struct ContactBodies {
    std::span<const double> inverse_mass;  // 1/kg; held: 0
    std::span<const double> own_share;     // of a push, what moves the particle alone and not its piece, 0 .. 1
    std::span<const uint32_t> piece;       // which of `pieces` a movable is part of
    std::span<const Vec3> start_position;  // at the start of the substep, m
    std::span<const Quat> start_rotation;
    std::span<MovingParticle> moving;
    std::span<ContactPush> push;
    std::span<ContactPiece> pieces;
};

/// Fills arms and approach speed, and decides what gap is wanted: none below `allowed_gap`, but old
/// overlap is worked off by a fifth a substep and no faster than `recovery_speed`, and only between separate pieces.
/// Call once a substep after detection.
void prepare_contacts(const ContactBodies& bodies, std::span<const Vec3> velocity,
                      std::span<const Vec3> angular_velocity, double h, double recovery_speed,
                      std::span<ActiveContact> io_contacts);

/// What each contact moves by an impulse along its normal, for the present own_share. Call before solving.
void weigh_contacts(const ContactBodies& bodies, std::span<ActiveContact> io_contacts);

/// Starts lasting contacts from a share of the forces they had; between rigid things that approach or part no faster
/// than `resting` (m/s) from most of it. `memory` ascending by (a, b).
void warm_start(const ContactBodies& bodies, std::span<const ContactMemory> memory, double h, double resting,
                std::span<ActiveContact> io_contacts);
void remember(const ContactBodies& bodies, std::span<const ActiveContact> contacts, double h,
              std::vector<ContactMemory>& o_memory);

/// One contact's turn in a Gauss-Seidel pass: gap >= wanted_gap and friction within its cone. Positions, their inertial
/// targets and `push` move alike, so that shape matching does not fight the contact. Motions of wholes are only added
/// up in `pieces`: linear in the impulses, so that what is solved here is what the books get, however large they are.
/// Returns the change of the gap, m.
double solve_contact(const ContactBodies& bodies, ActiveContact& io_contact);

/// Adds to the running impulses of a contact (kg m; rolling: kg m2) and moves both sides by them.
void add_impulses(const ContactBodies& bodies, double normal, const Vec3& friction, const Vec3& rolling,
                  ActiveContact& io_contact);

/// A velocity that is given to a whole piece.
struct PieceVelocity {
    Vec3 velocity = Vec3::Zero();  // m/s
    Vec3 spin = Vec3::Zero();      // about the centre of mass, rad/s
};

/// Velocities of touching points along the normal: approach ends, or turns around where the contact closed faster than
/// `threshold` m/s and restitution says so; what recovery added is taken out again. Changes particles' velocities by
/// their own share; `o_change` (as pieces) is to be given to all of a piece.
void settle_velocities(const ContactBodies& bodies, double h, double threshold, std::span<const ActiveContact> contacts,
                       std::span<const Vec3> angular_velocity, std::span<Vec3> io_velocity,
                       std::span<PieceVelocity> o_change);

}  // namespace sunder
