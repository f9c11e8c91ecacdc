// Contacts on positions: no overlap, Coulomb friction, rolling resistance, restitution. Overlap that was there before
// is worked off slowly and without giving speed.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/contact.h"
#include "solver/data/frame_state.h"
#include "solver/shape_matching.h"

namespace sunder {

/// A movable thing as contacts see it: what resists being pushed. Held things have inverse mass and inertia zero. A
/// particle that is bound to others does not turn by itself (inverse inertia zero): the torque of a push goes into the
/// books, and its piece turns as a whole.
struct ContactMass {
    double inverse_mass = 0;              // 1/kg
    Mat3 inverse_inertia = Mat3::Zero();  // world, at the start of the substep, 1/(kg m2)
};

/// What contacts did to a movable thing in this substep, for the momentum books.
struct ContactPush {
    Vec3 shift = Vec3::Zero();   // m
    Vec3 torque = Vec3::Zero();  // angular impulse times the substep, kg m2
};

/// A contact with its running impulses (in kg m: mass times displacement).
struct ActiveContact {
    Contact contact;
    Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();  // from the centres to the touching points, m
    Vec3 collider_motion = Vec3::Zero();              // of point_b over the substep where b is a collider, m
    double allowed_gap = 0;                           // overlap at rest of two fragments of one body, <= 0, m
    double friction = 0, restitution = 0;
    double rolling_arm = 0;          // resistance to rolling: torque = rolling_arm * normal force, m
    bool separate_pieces = true;     // overlap is worked off only between separate pieces
    double wanted_gap = 0;           // at the end of the substep, m
    double recovery = 0;             // part of it that works off old overlap, m
    double inverse_mass_normal = 0;  // 1/kg
    double approach_speed = 0;       // along the normal before the step, m/s
    double normal_impulse = 0;
    Vec3 friction_impulse = Vec3::Zero(), rolling_impulse = Vec3::Zero();
};

/// The movable things of a step, indexed as Contact does: where they were and where they are.
struct ContactBodies {
    std::span<const ContactMass> mass;
    std::span<const Vec3> start_position;  // at the start of the substep, m
    std::span<const Quat> start_rotation;
    std::span<MovingParticle> moving;
    std::span<ContactPush> push;
};

/// Fills arms, effective mass and approach speed, and decides what gap is wanted: none below `allowed_gap`, but old
/// overlap is worked off by a fifth a substep and no faster than `recovery_speed`, and only between separate pieces.
/// Call once a substep after detection.
void prepare_contacts(const ContactBodies& bodies, std::span<const Vec3> velocity,
                      std::span<const Vec3> angular_velocity, double h, double recovery_speed,
                      std::span<ActiveContact> io_contacts);

/// Starts lasting contacts from the forces they had. `memory` ascending by (a, b).
void warm_start(const ContactBodies& bodies, std::span<const ContactMemory> memory, double h,
                std::span<ActiveContact> io_contacts);
void remember(const ContactBodies& bodies, std::span<const ActiveContact> contacts, double h,
              std::vector<ContactMemory>& o_memory);

/// One Gauss-Seidel pass in stored order: gap >= wanted_gap and friction within its cone. Positions, their inertial
/// targets and `push` move alike, so that shape matching does not fight the contact. Returns the largest change of a
/// gap, m.
double solve_contacts(const ContactBodies& bodies, std::span<ActiveContact> io_contacts);

/// Velocities of touching points along the normal: approach ends, or turns around where the contact closed faster than
/// `threshold` m/s and restitution says so; what recovery added is taken out again.
void settle_velocities(std::span<const ContactMass> mass, double h, double threshold,
                       std::span<const ActiveContact> contacts, std::span<Vec3> io_velocity,
                       std::span<Vec3> io_angular_velocity);

}  // namespace sunder
