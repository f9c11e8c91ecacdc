// Everything that changes during a simulation, as one value: copy, compare, hash, save, rewind.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/data/ids.h"
#include "solver/data/math.h"

namespace sunder {

/// What pushed, or the seam that was told to break: a thing of the scene.
struct Pusher {
    enum class Kind : uint8_t { nothing, particle, rigid_body, collider, seam };
    Kind kind = Kind::nothing;
    uint32_t number = kNone;  // among those of its kind; of nothing: kNone
    bool operator==(const Pusher&) const = default;
};

/// An edge that broke: when, at which principal log strain of the group that cut it, and why: which strain it bore at
/// most, and what pressed hardest on its piece. No step reads why.
struct BrokenEdge {
    EdgeId edge;
    double time = 0;       // s
    double strain = 0;     // -, below 0: pressed
    double toughness = 0;  // |strain| at which it breaks there, -; 0: not told (files of before), or a seam's
    Pusher by = {};        // nothing: its own weight, pins or waves did it
    bool operator==(const BrokenEdge&) const = default;
};

/// The force of a contact, as far as it lasts, so that the next substep starts from it. `a` and `b` as in
/// solver/collision/contact.h.
struct ContactMemory {
    MovableId a, b;
    Vec3 point = Vec3::Zero();           // touching point of a, in the frame that turns with a, about its centre, m
    double normal_force = 0;             // N, >= 0
    Vec3 friction_force = Vec3::Zero();  // N, world
    Vec3 rolling_torque = Vec3::Zero();  // of the resistance to rolling, N m, world
    bool operator==(const ContactMemory&) const = default;
};

struct RigidBodyState {
    Vec3 position = Vec3::Zero();  // centre of mass, m
    Quat orientation = Quat::Identity();
    Vec3 velocity = Vec3::Zero();          // m/s
    Vec3 angular_velocity = Vec3::Zero();  // rad/s, world
    bool operator==(const RigidBodyState& o) const {
        return position == o.position && orientation.coeffs() == o.orientation.coeffs() && velocity == o.velocity &&
               angular_velocity == o.angular_velocity;
    }
};

/// Of a thin group's layers (solver/material/bending_flow.h), what the flow of their mean and moment leaves: of a sheet
/// seven times strain 11, 22, 12 in its plane, of a rod 29 fibres, -.
using LayerStrain = std::array<double, 29>;

/// Of a member of a thin group, in the axes of the group's fragment: what of where it lies and of how it is turned is
/// so for good, beside what F_P and K_P say.
struct MemberOffset {
    Vec3 shift = Vec3::Zero(), turn = Vec3::Zero();  // m, rad
    bool operator==(const MemberOffset&) const = default;
};
/// Of both ends of an edge a-b: of b in a's group, of a in b's.
using EdgeOffsets = std::array<MemberOffset, 2>;

/// What keeps a fragment from moving, or its edges from breaking, until a condition comes (Activation in
/// solver/scene/scene.h).
struct Inactivity {
    // kAsleep: held, and wakes with its piece. kTouched: a contact lets go of some of it.
    static constexpr uint8_t kHeld = 1, kAsleep = 2, kGlued = 4, kTouched = 8;

    uint8_t what = 0;
    std::array<double, 2> due = {HUGE_VAL, HUGE_VAL};  // when a front lets go what is held; what is glued, s
    double push = 0, former_push = 0;  // normal impulses of contacts in this frame, in the one before, N s
    double followed = HUGE_VAL;        // until when it followed a source, s; infinite: it does still, or there is none
    /// Of a source's fragment: whether it follows that.
    bool follows() const { return (what & (kHeld | kAsleep)) != 0 && followed == HUGE_VAL; }
    bool operator==(const Inactivity&) const = default;
};

struct FrameState {
    double time = 0;                        // since the first frame, s
    std::vector<Vec3> position;             // (n_particles x 3), m
    std::vector<Quat> orientation;          // (n_particles x 4)
    std::vector<Vec3> velocity;             // (n_particles x 3), m/s
    std::vector<Vec3> angular_velocity;     // (n_particles x 3), rad/s, world
    std::vector<Mat3> plastic_deformation;  // F_P of the particle's group, symmetric, det 1  (n_particles x 3 x 3)
    // Of thin groups; empty where no body bends by its curvature:
    std::vector<Mat3> plastic_curvature;    // K_P in the fragment's axes    (n_particles x 3 x 3), rad/m
    std::vector<LayerStrain> layer_strain;  // (n_particles)
    std::vector<EdgeOffsets> edge_offset;   // (n_edges x 2 x 2 x 3), m, rad
    std::vector<double> yielding_rate;      // what may flow in the next step, mean of a section (n_particles), 1/s
    std::vector<double> yield;              // present yield strain of the group (hardens)    (n_particles), -
    std::vector<double> strain;             // largest |principal elastic log strain|         (n_particles), -
    std::vector<Quat> group_rotation;       // optimal rotation, warm start of the next one   (n_particles x 4)
    std::vector<uint8_t> edge_intact;       // 1 until fracture removes the edge              (n_edges)
    // Of bodies with a fracture energy; empty where none has one:
    std::vector<double> edge_damage;       // 0 sound .. 1 parted, never falls                    (n_edges), -
    std::vector<double> edge_hold;         // of an edge's weight in its groups, what it still has  (n_edges), -
    std::vector<double> stiffness_factor;  // of a group's stiffness, for what its edges lost    (n_particles), -
    // Empty where the scene has no activations; `edge_bond`: but within a frame in which an edge's differs from 1.
    std::vector<Inactivity> inactive;  // (n_particles)
    std::vector<double> edge_bond;     // factor on the edge's toughness; infinite: it cannot break  (n_edges), -
    std::vector<RigidBodyState> rigid_bodies;  // (n_rigid_bodies)
    std::vector<ContactMemory> contacts;       // of the last substep, ascending by (a, b)
    std::vector<BrokenEdge> broken;            // edges broken in the frame that ended in this state

    // Of movables: particles, then rigid bodies. All four are empty where nothing was ever told to sleep.
    std::vector<double> still_time;         // for how long it has hardly moved                (n_movables), s
    std::vector<uint8_t> asleep;            // 1: it rests and is left out (sleeping.h)        (n_movables)
    std::vector<double> rest_load;          // of sleepers: normal forces on it when it fell asleep, sum (n_movables), N
    std::vector<uint64_t> rest_conditions;  // hashes of what acts on sleepers; empty: nothing sleeps

    size_t n_particles() const { return position.size(); }
    bool operator==(const FrameState& other) const;
};

/// Whether members of thin groups have flowed out of the shapes that F_P and K_P explain.
bool has_offsets(const FrameState& state);
/// Whether a thin group flowed in its last step.
bool is_yielding(const FrameState& state);

/// Hash of every bit of the state but why edges broke (BrokenEdge::toughness, by), which no step reads; equal states
/// hash equal on every machine of the same byte order.
uint64_t state_hash(const FrameState& state);

/// Hash of the bits of some numbers.
uint64_t hash_of(std::span<const double> numbers);

/// What tells one F_P from another in a ninth of its memory: a hash of its bits, never 0.
inline uint64_t plastic_key(const Mat3& F_P) { return hash_of({F_P.data(), 9}) | 1; }

}  // namespace sunder
