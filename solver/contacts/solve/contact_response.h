// Contacts on positions: no overlap, Coulomb friction, rolling resistance, restitution. Overlap that was there before
// is worked off slowly and without giving speed.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/contact.h"
#include "solver/data/frame_state.h"
#include "solver/matching/shape_matching.h"

namespace sunder {

/// What a piece is of.
enum class PieceKind : uint8_t {
    whole,   // fragments that hang together; every edge that they had is intact
    torn,    // likewise, but some broke
    single,  // a fragment that is all of its body
    chip,    // a fragment that broke off
    rigid_body
};
constexpr bool is_lone(PieceKind kind) { return kind == PieceKind::single || kind == PieceKind::chip; }
constexpr bool is_unbroken(PieceKind kind) { return kind != PieceKind::torn && kind != PieceKind::chip; }

/// What moves as a whole: a piece (a lone fragment is one) or a rigid body.
struct ContactPiece {
    Vec3 center = Vec3::Zero();           // of mass, at the start of the substep, m
    double inverse_mass = 0;              // 1/kg; held: 0
    Mat3 inverse_inertia = Mat3::Zero();  // about the centre, world, at the start of the substep, 1/(kg m2); held: 0
    PieceKind kind = PieceKind::torn;
    bool rigid = false;          // nothing in it gives: free, and a lone fragment or a rigid body; or asleep
    double own_share = 1;        // of a push, what moves the particle alone and not the piece, 0 .. 1; free
    Vec3 turned = Vec3::Zero();  // since the start of the substep, rad; held: 0
    Vec3 spin = Vec3::Zero();    // of the whole of it, rad/s, at the start, then at the end; held: 0

    /// By pins; sleepers, which nothing moves either, are rigid.
    bool is_held() const { return !rigid && inverse_mass == 0; }
};

/// What contacts did to a movable thing in this substep, for the momentum books.
struct ContactPush {
    Vec3 shift = Vec3::Zero();   // m
    Vec3 torque = Vec3::Zero();  // angular impulse times the substep, kg m2
};

/// Running impulses of a contact, mass times displacement.
struct ContactImpulse {
    double normal = 0;             // kg m
    Vec3 friction = Vec3::Zero();  // kg m
    Vec3 rolling = Vec3::Zero();   // kg m2

    bool is_zero() const { return normal == 0 && friction.isZero(0) && rolling.isZero(0); }
    friend ContactImpulse operator+(const ContactImpulse& p, const ContactImpulse& q) {
        return {p.normal + q.normal, p.friction + q.friction, p.rolling + q.rolling};
    }
    friend ContactImpulse operator*(double s, const ContactImpulse& p) {
        return {s * p.normal, s * p.friction, s * p.rolling};
    }
    friend ContactImpulse operator-(const ContactImpulse& p, const ContactImpulse& q) { return p + -1.0 * q; }
};

/// A contact in a substep.
struct ActiveContact {
    Contact contact;
    Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();  // from the centres to the touching points, m
    Vec3 collider_motion = Vec3::Zero();              // of point_b over the substep where b is a collider, m
    double allowed_gap = 0;                           // at which what the ellipsoids stand for touches, m
    double friction = 0, restitution = 0;
    double rolling_arm = 0;          // resistance to rolling: torque = rolling_arm * normal force, m
    bool separate_pieces = true;     // overlap is worked off only between separate pieces
    bool has_hinges = false;         // its island has a piece that is partly broken
    double wanted_gap = 0;           // at the end of the substep, m
    double recovery = 0;             // part of it that works off old overlap, m
    double inverse_mass_normal = 0;  // in the last round, 1/kg
    double approach_speed = 0;       // along the normal before the step, m/s
    ContactImpulse before;           // with which the last substep ended, as far as that lasts
    ContactImpulse impulse;
};

/// The movable things of a step, indexed as Contact does: where they were and where they are.
struct ContactBodies {
    std::span<const double> inverse_mass;  // 1/kg; held: 0
    std::span<const PieceId> piece;        // which of `pieces` a movable is part of
    std::span<const Vec3> start_position;  // at the start of the substep, m
    std::span<const Quat> start_rotation;
    std::span<const MovingParticle> moving;
    std::span<const ContactPiece> pieces;
    std::span<const double> held_share = {};  // own_share of particles of held pieces; empty where no piece is held
};

/// How a push at a touching point divides. `own`: displacement by a unit impulse of the particle alone, `whole`: of its
/// piece, 1/kg. With `lever` from the piece's centre to the particle's and `arm` from there to the touching point, an
/// impulse f turns by I^-1 (arm x f) + orbit_share I^-1 (lever x f) the particles' centres about the piece's, and by
/// I^-1 (arm + lever) x f the particles themselves. So with s = own_share it is
///
///     rigid motion of the piece by all of f  +  s (f / m of the particle alone - rigid motion by f at its centre):
///
/// momentum comes out right for any s; soft bodies give where they are touched (s = 1), stiff ones go as a whole
/// (s = 0), and shape matching finds the rest. With one s a piece it is symmetric (what a push at i moves j by is what
/// one at j moves i by) and positive, as the implicit step's own response is, so that passes over contacts converge. In
/// held pieces, which nothing moves as wholes, it is with an s of each particle.
struct PushDivision {
    double own = 0, whole = 0, orbit_share = 0;
    Vec3 lever = Vec3::Zero();  // m
};
PushDivision divide_push(const ContactBodies& bodies, MovableIndex movable);

/// From the centre of its piece to a movable's at the start of the substep, m.
Vec3 lever_of(const ContactBodies& bodies, MovableIndex movable);

/// By a rotation of less than a radian, to second order: rad.
inline Vec3 turned_by(const Quat& rotation) { return rotation.vec() * (rotation.w() < 0 ? -2.0 : 2.0); }

/// How a touching point of a movable turns about its centre since the start of the substep, rad: with its piece, for it
/// is the piece that a push there turns. What friction measures by and what it moves are one motion that way; with the
/// particle's own turning, which goes its own way in soft bodies, friction did work on points that did not slip, and
/// all that stood on the floor swayed for ever. Pieces that pins hold are turned by no push: there only pinned
/// particles turn, as they are told.
Vec3 turned(const ContactBodies& bodies, MovableIndex movable);

inline bool has_movable_b(const Contact& c) { return !(c.b & Contact::kStatic); }

/// Fills arms and approach speed, and decides what gap is wanted: none below `allowed_gap`, but old
/// overlap is worked off by a fifth in the 5.2 ms of a default substep, as much in longer ones, and no faster than
/// `recovery_speed`, and only between separate pieces, as each contact alone would have it (`agree_on_recovery` comes
/// next). Call once a substep after detection.
void prepare_contacts(const ContactBodies& bodies, std::span<const Vec3> velocity,
                      std::span<const Vec3> angular_velocity, double h, double recovery_speed,
                      std::span<ActiveContact> io_contacts);

/// A velocity that is given to a whole piece.
struct PieceVelocity {
    Vec3 velocity = Vec3::Zero();  // m/s
    Vec3 turn = Vec3::Zero();      // of the particles' centres about the piece's, rad/s
    Vec3 spin = Vec3::Zero();      // of the particles about their own centres, rad/s
};

/// Velocities of touching points along the normal: approach ends, or turns around where the contact closed faster than
/// `threshold` m/s and restitution says so; what recovery added is taken out again. Of the contacts of an island, one
/// after the other (`which`). Changes particles' velocities by their own share; `io_change` (as pieces; zero to begin
/// with) is to be given to all of a piece.
void settle_velocities(const ContactBodies& bodies, double h, double threshold, std::span<const ActiveContact> contacts,
                       std::span<const ContactId> which, std::span<const Vec3> angular_velocity,
                       std::span<Vec3> io_velocity, std::span<PieceVelocity> io_change);

}  // namespace sunder
