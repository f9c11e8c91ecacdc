// A round over the contacts of a substep: projected Gauss-Seidel passes on impulses. What they move is only added up
// while the round lasts, linear in the impulses and packed island by island, and given to the pieces when it ends.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/contact_islands.h"
#include "solver/parallel.h"

namespace sunder {

/// What a round moves a piece by, besides what it moves particles by alone.
struct PieceMotion {
    Vec3 shift = Vec3::Zero();  // m
    Vec3 turn = Vec3::Zero();   // of the particles' centres about the piece's, rad
    Vec3 spin = Vec3::Zero();   // of the particles about their own centres, rad

    friend PieceMotion operator+(const PieceMotion& p, const PieceMotion& q) {
        return {p.shift + q.shift, p.turn + q.turn, p.spin + q.spin};
    }
    friend PieceMotion operator*(double s, const PieceMotion& p) { return {s * p.shift, s * p.turn, s * p.spin}; }
    friend PieceMotion operator-(const PieceMotion& p, const PieceMotion& q) { return p + -1.0 * q; }
};

/// What a round gives to a movable thing.
struct RoundPush {
    Vec3 own = Vec3::Zero();     // displacement of it alone, m
    Vec3 shift = Vec3::Zero();   // impulse over its mass, m
    Vec3 torque = Vec3::Zero();  // angular impulse times the substep, kg m2
};

class ContactRound {
public:
    enum class Which {
        first,    // impulses that contacts have are still to be given
        between,  // they were; pushes divide as in the round before
        last      // they were, and no shape matching follows: contacts within a piece, which no motion of the whole can
                  // part, are left alone
    };
    /// Takes up contacts as they are and where their things are.
    void begin(const ContactBodies& bodies, const ContactIslands& islands, Which which, const WorkerPool& workers,
               std::span<const ActiveContact> contacts);

    /// Displacement of a's touching point less that of b's since the start of the substep, m; of the contact at `place`
    /// of the islands' list.
    Vec3 motion(size_t place) const;

    /// Solves every island to where no pass changes a gap by more than `enough` (m), within so many passes as pay: 60,
    /// or 12 where something hangs on hinges; accelerated like nonlinear conjugate gradients (Silcowitz-Hansen,
    /// Niebuhr, Erleben 2010), so that tall stacks and heavy on light stand. Threads share out islands.
    void relax(double enough, const WorkerPool& workers);

    /// Writes back impulses, and what they moved; `io_push` and `io_motion` must be zero, and stay so where the islands
    /// touch nothing.
    void end(const ContactBodies& bodies, std::span<ActiveContact> io_contacts, std::span<RoundPush> io_push,
             std::span<PieceMotion> io_motion) const;

private:
    // Slots of what a side of a contact pushes; those of colliders come last, where nothing ever moves.
    struct Side {
        uint32_t movable = 0, piece = 0;
        Vec3 arm = Vec3::Zero();  // from the movable's centre to the touching point, m
    };
    // What a pass reads and writes of a contact: first what one reads that pushes nothing.
    struct alignas(64) Row {
        Side a, b;
        Vec3 normal = Vec3::Zero();
        double missing = 0;       // of the gap, where nothing moves since the round began, m
        double inverse_mass = 0;  // along the normal, 1/kg; 0: is let alone
        bool idle = true;         // no impulse, and none to follow
        bool on_collider = false;
        Vec3 motion = Vec3::Zero(), rolled = Vec3::Zero();  // a's less b's where the round began, m and rad
        Vec3 along_normal = Vec3::Zero();                   // that motion by a unit impulse along the normal, 1/kg
        double slip_mass = 0;                               // the least along any tangent, kg
        double rolling_inertia = 0;                         // the least about any axis, kg m2
        double friction = 0, rolling_arm = 0;
        // The last pass changed the impulse by `change`; `direction` is what passes moved it by, followed so far.
        ContactImpulse impulse, change, direction;
    };
    // Of a movable and of a piece, by slot: what passes move it by, and how pushes do (see PushDivision).
    struct alignas(64) Movable {
        Vec3 moved = Vec3::Zero(), lever = Vec3::Zero();  // m
        double own = 0;
    };
    struct Piece {
        PieceMotion moved;
        Mat3 inverse_inertia = Mat3::Zero();
        double whole = 0, orbit_share = 0;
    };
    // Since the start of the substep, where the round began.
    struct Began {
        Vec3 shift = Vec3::Zero(), turned = Vec3::Zero();  // m, rad
    };
    struct Range {
        uint32_t begin, end;
    };
    // How far a pass follows the direction of those before it.
    struct Following {
        double share = 0;
        bool keeps = true;  // else the direction is forgotten
    };
    struct PassResult {
        double largest = 0;  // change of a gap, m
        double size = 0;     // squared length of the change, as displacements weigh it, kg m2
    };

    void take_up_movables(const ContactBodies& bodies);
    Side side_of(const ContactBodies& bodies, uint32_t movable, const Vec3& arm) const;
    Mat3 response_of(const Side& side) const;
    void describe(const ContactBodies& bodies, const ActiveContact& contact, Which which, Row& o_row) const;
    void start(const ActiveContact& contact, Row& io_row) const;
    Vec3 moved(const Side& side) const;
    void push(const Side& side, const Vec3& impulse);
    void turn(const Side& side, const Vec3& couple);
    void move_by(const Row& row, const Vec3& impulse);
    void turn_by(const Row& row, const Vec3& couple);
    void resist_slip(Row& io_row, const Vec3& moved_by, Vec3& io_impulse) const;
    void resist_rolling(Row& io_row);
    void solve(Row& io_row, const Following& following, PassResult& io_result);
    PassResult pass_over_all(const Range& rows, const Following& following, std::span<uint32_t>& o_active);
    PassResult pass_over(std::span<const uint32_t> active, const Following& following);
    void follow(const Range& movables, const Range& pieces, const Following& following);
    void relax_island(size_t island, double enough);

    const ContactIslands* islands_ = nullptr;
    Which which_ = Which::first;
    std::vector<Row> rows_;         // as the islands' contacts
    std::vector<uint32_t> active_;  // rows, island by island
    std::vector<Movable> movables_;
    std::vector<Piece> pieces_;
    std::vector<Began> began_;  // by slot of movables
    // Of movables and pieces: where the last pass began, and the direction that passes follow.
    std::vector<Vec3> movable_before_, movable_direction_;
    std::vector<PieceMotion> piece_before_, piece_direction_;
    std::vector<uint8_t> hinged_;  // (n_islands)
};

}  // namespace sunder
