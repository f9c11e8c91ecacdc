#include "solver/collision/contact_round.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace sunder {
namespace {

constexpr int kPasses = 60, kHingedPasses = 12;
// The first passes, every so many, and those that find nothing left to do go over all contacts; the others over those
// that pushed in the last of these.
constexpr int kFirstFull = 2, kEveryFull = 4;
constexpr size_t kGrain = 16, kRowGrain = 256;  // fewest contacts a thread is worth waking for, to solve and to set up
constexpr double kTiny = 1e-300;
#define inline __attribute__((always_inline))

Mat3 cross_matrix(const Vec3& v) {
    Mat3 m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

// No eigenvalue of the symmetric matrix is larger, and this one by little where they are alike.
double largest_eigenvalue_bound(const Mat3& m) {
    const double mean = m.trace() / 3;
    return mean + 2 * std::sqrt((m - mean * Mat3::Identity()).squaredNorm() / 6);
}

// Moves `io_total` by `change`, but not beyond length `limit`; returns the change that was made.
Vec3 change_within(Vec3& io_total, const Vec3& change, double limit) {
    const Vec3 before = io_total;
    io_total += change;
    if (const double squared = io_total.squaredNorm(); squared > limit * limit)
        io_total *= limit / std::max(std::sqrt(squared), kTiny);
    return io_total - before;
}

// A pass is a step down the gradient; as much of the last direction is added to it as the steps' shrinking allows.
template <class T>
void follow_direction(T& io_value, T& io_direction, const T& change, double share, bool keeps) {
    io_value = io_value + share * io_direction;
    io_direction = keeps ? T(change + share * io_direction) : T(0.0 * change);
}

}  // namespace

void ContactRound::take_up_movables(const ContactBodies& b) {
    const size_t n_movables = islands_->movable.size(), n_pieces = islands_->piece.size();
    movables_.assign(n_movables + 1, Movable());
    began_.assign(n_movables + 1, Began());
    pieces_.assign(n_pieces + 1, Piece());
    for (size_t k = 0; k < n_pieces; ++k) pieces_[k].inverse_inertia = b.pieces[islands_->piece[k]].inverse_inertia;
    for (size_t k = 0; k < n_movables; ++k) {
        const uint32_t i = islands_->movable[k];
        const PushDivision division = divide_push(b, i);
        movables_[k].lever = division.lever, movables_[k].own = division.own;
        Piece& piece = pieces_[islands_->piece_slot[b.piece[i]]];
        piece.whole = division.whole, piece.orbit_share = division.orbit_share;
        began_[k] = {b.moving[i].x - b.start_position[i], turned(b, i)};
    }
    movable_before_.assign(movables_.size(), Vec3::Zero()), movable_direction_ = movable_before_;
    piece_before_.assign(pieces_.size(), PieceMotion()), piece_direction_ = piece_before_;
}

ContactRound::Side ContactRound::side_of(const ContactBodies& b, uint32_t movable, const Vec3& arm) const {
    return {islands_->movable_slot[movable], islands_->piece_slot[b.piece[movable]], arm};
}

// Displacement of the touching point by a unit impulse there.
Mat3 ContactRound::response_of(const Side& s) const {
    const Movable& movable = movables_[s.movable];
    const Piece& piece = pieces_[s.piece];
    const Mat3 arm = cross_matrix(s.arm), lever = cross_matrix(movable.lever);
    const Mat3 by_arm = piece.inverse_inertia * arm, by_lever = piece.inverse_inertia * lever;
    return (movable.own + piece.whole) * Mat3::Identity() - lever * (by_arm + piece.orbit_share * by_lever) -
           arm * (by_arm + by_lever);
}

// What stays from round to round, but for the last.
void ContactRound::describe(const ContactBodies& b, const ActiveContact& c, Which which, Row& row) const {
    row = Row();
    row.a = side_of(b, c.contact.a, c.arm_a);
    row.on_collider = !has_movable_b(c.contact);
    if (row.on_collider)
        row.b = {static_cast<uint32_t>(movables_.size() - 1), static_cast<uint32_t>(pieces_.size() - 1), c.arm_b};
    else
        row.b = side_of(b, c.contact.b, c.arm_b);
    const Mat3 response = response_of(row.a) + response_of(row.b);
    row.normal = c.contact.normal;
    row.along_normal = response * row.normal;
    row.inverse_mass = which == Which::last && !c.separate_pieces ? 0.0 : row.normal.dot(row.along_normal);
    const Mat3 across = Mat3::Identity() - row.normal * row.normal.transpose(), K = across * response * across;
    // Two eigenvalues besides the zero.
    const double half = K.trace() / 2;
    row.slip_mass = 1 / std::max(half + std::sqrt(std::max(K.squaredNorm() / 2 - half * half, 0.0)), kTiny);
    row.friction = c.friction, row.rolling_arm = c.rolling_arm;
    const Mat3 turning = pieces_[row.a.piece].inverse_inertia + pieces_[row.b.piece].inverse_inertia;
    row.rolling_inertia = 1 / std::max(largest_eigenvalue_bound(turning), kTiny);
}

void ContactRound::start(const ActiveContact& c, Row& row) const {
    const Began &a = began_[row.a.movable], &b = began_[row.b.movable];
    row.motion = a.shift + a.turned.cross(row.a.arm) - b.shift - b.turned.cross(row.b.arm);
    if (row.on_collider) row.motion -= c.collider_motion;
    row.rolled = a.turned - b.turned;
    row.missing = c.wanted_gap - c.contact.gap - row.normal.dot(row.motion);
    row.impulse = c.impulse;
    row.change = row.direction = ContactImpulse();
    row.idle = c.impulse.is_zero();
}

void ContactRound::begin(const ContactBodies& b, const ContactIslands& islands, Which which, const WorkerPool& workers,
                         std::span<const ActiveContact> contacts) {
    assert(which != Which::between || rows_.size() == contacts.size());
    islands_ = &islands, which_ = which;
    take_up_movables(b);
    rows_.resize(contacts.size()), active_.resize(contacts.size());
    workers.for_range(contacts.size(), kRowGrain, [&](size_t first, size_t end) {
        for (size_t k = first; k < end; ++k) {
            const ActiveContact& c = contacts[islands.contact[k]];
            if (which != Which::between) describe(b, c, which, rows_[k]);
            start(c, rows_[k]);
        }
    });
    hinged_.resize(islands.size());
    for (size_t n = 0; n < islands.size(); ++n) hinged_[n] = contacts[islands.contact[islands.offset[n]]].has_hinges;
    if (which != Which::first) return;
    for (const Row& row : rows_) {
        move_by(row, row.impulse.normal * row.normal + row.impulse.friction);
        turn_by(row, row.impulse.rolling);
    }
}

Vec3 ContactRound::moved(const Side& s) const {
    const Movable& movable = movables_[s.movable];
    const PieceMotion& piece = pieces_[s.piece].moved;
    return movable.moved + piece.shift + piece.turn.cross(movable.lever) + piece.spin.cross(s.arm);
}

Vec3 ContactRound::motion(size_t place) const {
    const Row& row = rows_[place];
    return row.motion + moved(row.a) - moved(row.b);
}

void ContactRound::push(const Side& s, const Vec3& impulse) {
    Movable& movable = movables_[s.movable];
    Piece& piece = pieces_[s.piece];
    const Vec3 by_arm = piece.inverse_inertia * s.arm.cross(impulse);
    const Vec3 by_lever = piece.inverse_inertia * movable.lever.cross(impulse);
    movable.moved += movable.own * impulse;
    piece.moved.shift += piece.whole * impulse;
    piece.moved.turn += by_arm + piece.orbit_share * by_lever;
    piece.moved.spin += by_arm + by_lever;
}

void ContactRound::turn(const Side& s, const Vec3& couple) {
    Piece& piece = pieces_[s.piece];
    const Vec3 turned = piece.inverse_inertia * couple;
    piece.moved.turn += turned;
    piece.moved.spin += turned;
}

void ContactRound::move_by(const Row& row, const Vec3& impulse) {
    push(row.a, impulse);
    if (!row.on_collider) push(row.b, -impulse);
}

void ContactRound::turn_by(const Row& row, const Vec3& couple) {
    turn(row.a, couple);
    if (!row.on_collider) turn(row.b, -couple);
}

// Adds friction to `io_impulse`, after which the touching points have moved by `moved_by`.
void ContactRound::resist_slip(Row& row, const Vec3& moved_by, Vec3& io_impulse) const {
    const double limit = row.friction * row.impulse.normal;
    if (!(limit > 0) && row.impulse.friction.isZero(0)) return;
    const Vec3 slip = moved_by - row.normal * row.normal.dot(moved_by);
    io_impulse += change_within(row.impulse.friction, -row.slip_mass * slip, limit);
}

void ContactRound::resist_rolling(Row& row) {
    const double limit = row.rolling_arm * row.impulse.normal;
    if (!(limit > 0) && row.impulse.rolling.isZero(0)) return;
    const Vec3 rolled = row.rolled + pieces_[row.a.piece].moved.spin - pieces_[row.b.piece].moved.spin;
    turn_by(row, change_within(row.impulse.rolling, -row.rolling_inertia * rolled, limit));
}

// One contact's turn in a pass: gap >= wanted_gap, friction within its cone, rolling resistance within its bound.
void ContactRound::solve(Row& row, const Following& following, PassResult& io_result) {
    if (!(row.inverse_mass > 0)) return;
    const Vec3 moved_by = moved(row.a) - moved(row.b);
    const double missing = row.missing - row.normal.dot(moved_by);
    if (row.idle && missing <= 0) return;

    ContactImpulse& now = row.impulse;
    follow_direction(now, row.direction, row.change, following.share, following.keeps);
    const ContactImpulse before = now;
    now.normal = std::max(now.normal + missing / row.inverse_mass, 0.0);
    const double change = now.normal - before.normal;
    Vec3 impulse = change * row.normal;
    resist_slip(row, row.motion + moved_by + change * row.along_normal, impulse);
    if (!impulse.isZero(0)) move_by(row, impulse);
    if (row.rolling_arm > 0) resist_rolling(row);

    row.change = now - before;
    row.idle = now.is_zero() && before.is_zero() && row.direction.is_zero();
    const double arm = row.rolling_arm;
    const double rolling = arm > 0 ? row.change.rolling.squaredNorm() / (arm * arm) : 0;
    io_result.largest = std::max(io_result.largest, std::abs(change) * row.inverse_mass);
    io_result.size += row.inverse_mass * (change * change + row.change.friction.squaredNorm() + rolling);
}

// What contacts do with their impulses when their turn comes, for all that they push: it is linear in them.
void ContactRound::follow(const Range& movables, const Range& pieces, const Following& following) {
    const auto [share, keeps] = following;
    for (uint32_t k = movables.begin; k < movables.end; ++k) {
        Vec3& moved = movables_[k].moved;
        const Vec3 change = moved - movable_before_[k];
        follow_direction(moved, movable_direction_[k], change, share, keeps);
        movable_before_[k] = moved;
    }
    for (uint32_t k = pieces.begin; k < pieces.end; ++k) {
        PieceMotion& moved = pieces_[k].moved;
        const PieceMotion change = moved - piece_before_[k];
        follow_direction(moved, piece_direction_[k], change, share, keeps);
        piece_before_[k] = moved;
    }
}

ContactRound::PassResult ContactRound::pass_over_all(const Range& rows, const Following& following,
                                                     std::span<uint32_t>& o_active) {
    PassResult result;
    size_t n_active = 0;
    for (uint32_t k = rows.begin; k < rows.end; ++k) {
        solve(rows_[k], following, result);
        if (!rows_[k].idle) active_[rows.begin + n_active++] = k;
    }
    o_active = std::span(active_).subspan(rows.begin, n_active);
    return result;
}

ContactRound::PassResult ContactRound::pass_over(std::span<const uint32_t> active, const Following& following) {
    PassResult result;
    for (uint32_t k : active) solve(rows_[k], following, result);
    return result;
}

void ContactRound::relax_island(size_t island, double enough) {
    const Range rows{islands_->offset[island], islands_->offset[island + 1]};
    const Range movables{islands_->movable_offset[island], islands_->movable_offset[island + 1]};
    const Range pieces{islands_->piece_offset[island], islands_->piece_offset[island + 1]};
    const int passes = hinged_[island] ? kHingedPasses : kPasses;
    std::span<uint32_t> active;
    Following following{0, false};
    double last = 0;
    bool done = false;
    for (int pass = 0; pass < passes; ++pass) {
        follow(movables, pieces, following);
        const bool all = done || pass < kFirstFull || pass % kEveryFull == 0 || pass + 1 == passes;
        const PassResult result = all ? pass_over_all(rows, following, active) : pass_over(active, following);
        done = result.largest < enough;
        if (done && all) return;
        const bool grows = pass > 0 && result.size > last;
        following = {pass > 0 && !grows ? result.size / last : 0.0, !grows};
        last = std::max(result.size, kTiny);
    }
}

void ContactRound::relax(double enough, const WorkerPool& workers) {
    // Threads share out contacts, and take the islands that begin among theirs.
    const auto island_from = [&](size_t contact) {
        return static_cast<size_t>(std::ranges::lower_bound(islands_->offset, contact) - islands_->offset.begin());
    };
    workers.for_range(rows_.size(), kGrain, [&](size_t first, size_t end) {
        for (size_t n = island_from(first), beyond = island_from(end); n < beyond; ++n) relax_island(n, enough);
    });
}

void ContactRound::end(const ContactBodies& b, std::span<ActiveContact> io_contacts, std::span<RoundPush> io_push,
                       std::span<PieceMotion> io_motion) const {
    for (size_t k = 0; k < islands_->movable.size(); ++k) io_push[islands_->movable[k]].own = movables_[k].moved;
    for (size_t k = 0; k < islands_->piece.size(); ++k) io_motion[islands_->piece[k]] = pieces_[k].moved;
    for (size_t place = 0; place < rows_.size(); ++place) {
        const Row& row = rows_[place];
        ActiveContact& c = io_contacts[islands_->contact[place]];
        c.inverse_mass_normal = row.inverse_mass;
        const ContactImpulse given = which_ == Which::first ? row.impulse : row.impulse - c.impulse;
        c.impulse = row.impulse;
        if (given.is_zero()) continue;
        const auto give = [&](uint32_t i, const Side& side, double sign) {
            if (!(b.inverse_mass[i] > 0)) return;
            const Vec3 impulse = sign * (given.normal * row.normal + given.friction);
            io_push[i].shift += b.inverse_mass[i] * impulse;
            io_push[i].torque += side.arm.cross(impulse) + sign * given.rolling;
        };
        give(c.contact.a, row.a, 1);
        if (!row.on_collider) give(c.contact.b, row.b, -1);
    }
}

}  // namespace sunder
