// Contacts on positions: no deeper than before, Coulomb friction, rolling resistance, restitution; overlap that was
// already there is pushed out without giving speed.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/contact.h"
#include "solver/shape_matching.h"

namespace sunder {

/// A movable thing as contacts see it: what resists being pushed. Held things have inverse mass and inertia zero.
struct ContactMass {
    double inverse_mass = 0;                    // 1/kg
    Mat3 inverse_inertia = Mat3::Zero();        // world, at the start of the substep, 1/(kg m2)
};

/// What contacts did to a movable thing in this substep, for the momentum books.
struct ContactPush {
    Vec3 shift = Vec3::Zero();                  // m
    Vec3 turn = Vec3::Zero();                   // rad
};

/// A contact with its running impulses (in kg m: mass times displacement).
struct ActiveContact {
    Contact contact;
    Vec3 arm_a, arm_b;                          // from the centres to the touching points, m
    Vec3 collider_motion = Vec3::Zero();        // of point_b over the substep where b is a collider, m
    double allowed_gap = 0;                     // overlap at rest of two fragments of one body, <= 0, m
    double friction = 0, restitution = 0;
    double rolling_arm = 0;                     // resistance to rolling: torque = rolling_arm * normal force, m
    bool separate_pieces = true;                // overlap is pushed out only between separate pieces
    double inverse_mass_normal = 0;             // 1/kg
    double approach_speed = 0;                  // along the normal before the step, m/s
    double normal_impulse = 0;
    Vec3 friction_impulse = Vec3::Zero(), rolling_impulse = Vec3::Zero();
};

/// The movable things of a step, indexed as Contact does: where they were and where they are.
struct ContactBodies {
    std::span<const ContactMass> mass;
    std::span<const Vec3> start_position;       // at the start of the substep, m
    std::span<const Quat> start_rotation;
    std::span<MovingParticle> moving;
    std::span<ContactPush> push;
};

/// Fills arms, effective mass and approach speed; call once a substep after detection.
void prepare_contacts(const ContactBodies& bodies, std::span<const Vec3> velocity, std::span<const Vec3> angular_velocity, double h,
                      std::span<ActiveContact> io_contacts);

/// One Gauss-Seidel pass in stored order: gap >= min(allowed_gap, gap at the start) and friction within its cone.
/// Positions, their inertial targets and `push` move alike, so that shape matching does not fight the contact.
void solve_contacts(const ContactBodies& bodies, std::span<ActiveContact> io_contacts);

/// Restitution for contacts that closed faster than `threshold` m/s.
void bounce(std::span<const ContactMass> mass, double h, double threshold, std::span<const ActiveContact> contacts,
            std::span<Vec3> io_velocity, std::span<Vec3> io_angular_velocity);

/// Moves separate pieces apart where they still overlap by more than allowed: a fifth of the overlap, at most
/// `speed * h`. Positions only; velocities do not see it.
void push_out_overlap(const ContactBodies& bodies, double speed, double h, std::span<const ActiveContact> contacts);

}  // namespace sunder
