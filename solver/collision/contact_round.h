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
        between,  // they were
        last      // they were, and no shape matching follows: contacts within a piece, which no motion of the whole can
                  // part, are left alone
    };
    /// Takes up contacts as they are and where their things are.
    void begin(const ContactBodies& bodies, const ContactIslands& islands, Which which, const WorkerPool& workers,
               std::span<const ActiveContact> contacts);

    /// Displacement of a's touching point less that of b's since the start of the substep, m; of the contact at `place`
    /// of the islands' list.
    Vec3 motion(size_t place) const { return motion(rows_[place]); }

    /// Solves every island to where no pass changes a gap by more than `enough` (m), within so many passes as pay: 60,
    /// or 12 where something hangs on hinges; accelerated like nonlinear conjugate gradients (Silcowitz-Hansen,
    /// Niebuhr, Erleben 2010), so that tall stacks and heavy on light stand. Threads share out islands.
    void relax(double enough, const WorkerPool& workers);

    /// Writes back impulses, and what they moved; `io_push` and `io_motion` must be zero, and stay so where the islands
    /// touch nothing.
    void end(const ContactBodies& bodies, std::span<ActiveContact> io_contacts, std::span<RoundPush> io_push,
             std::span<PieceMotion> io_motion) const;

private:
    // One side of a contact: slots of what is pushed, and how.
    struct Side {
        uint32_t movable = 0, piece = 0;
        bool moves = false;
        Vec3 arm = Vec3::Zero();
        PushDivision division;
    };
    struct Row {
        Side a, b;
        Vec3 normal = Vec3::Zero();
        Vec3 motion = Vec3::Zero(), rolled = Vec3::Zero();  // a's less b's where the round began, m and rad
        Mat3 response = Mat3::Zero();                       // of that motion to a unit impulse, 1/kg
        Vec3 along_normal = Vec3::Zero();                   // response to the normal
        double inverse_mass = 0;                            // of it, along the normal; 0: is let alone
        double gap = 0, wanted_gap = 0, friction = 0, rolling_arm = 0;
        ContactImpulse impulse, impulse_before;  // impulse_before: where the round began
    };
    // What passes change.
    struct Motions {
        std::vector<ContactImpulse> impulse;  // as rows; those of now are in the rows
        std::vector<Vec3> own;                // by slot of movables, m
        std::vector<PieceMotion> whole;       // by slot of pieces
    };
    struct Range {
        uint32_t begin, end;
    };

    Side side_of(const ContactBodies& bodies, uint32_t movable, const Vec3& arm) const;
    Row row_of(const ContactBodies& bodies, const ActiveContact& contact, Which which) const;
    Mat3 response_of(const Side& side) const;
    Vec3 moved(const Side& side) const;
    Vec3 motion(const Row& row) const;
    void push_side(const Side& side, const Vec3& impulse);
    void turn_side(const Side& side, const Vec3& couple);
    void move_by(const Row& row, const ContactImpulse& added);
    double solve(Row& io_row);
    void resist_rolling(Row& io_row);
    double pass_over(const Range& rows);
    static double size_of(const Row& row, const ContactImpulse& change);
    void relax_island(size_t island, double enough);

    const ContactIslands* islands_ = nullptr;
    std::vector<Row> rows_;              // as the islands' contacts
    std::vector<Mat3> inverse_inertia_;  // by slot of pieces
    Motions now_, before_, direction_;
    std::vector<uint8_t> hinged_;  // (n_islands)
};

}  // namespace sunder
