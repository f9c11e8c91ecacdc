#include "solver/collision/contact_round.h"

#include <algorithm>
#include <cmath>

namespace sunder {
namespace {

constexpr int kPasses = 60, kHingedPasses = 12;
constexpr size_t kGrain = 16, kRowGrain = 256;  // fewest contacts a thread is worth waking for, to solve and to set up
constexpr double kTiny = 1e-300;

Mat3 cross_matrix(const Vec3& v) {
    Mat3 m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

// Moves `io_total` by `change`, but not beyond length `limit`; returns the change that was made.
Vec3 change_within(Vec3& io_total, const Vec3& change, double limit) {
    const Vec3 before = io_total;
    io_total += change;
    if (const double size = io_total.norm(); size > limit) io_total *= limit / std::max(size, kTiny);
    return io_total - before;
}

}  // namespace

ContactRound::Side ContactRound::side_of(const ContactBodies& b, uint32_t movable, const Vec3& arm) const {
    return {islands_->movable_slot[movable], islands_->piece_slot[b.piece[movable]], b.inverse_mass[movable] > 0, arm,
            divide_push(b, movable)};
}

// Displacement of the touching point by a unit impulse there.
Mat3 ContactRound::response_of(const Side& s) const {
    if (!s.moves) return Mat3::Zero();
    const PushDivision& d = s.division;
    const Mat3& J = inverse_inertia_[s.piece];
    const Mat3 arm = cross_matrix(s.arm), lever = cross_matrix(d.lever);
    const Mat3 by_arm = J * arm, by_lever = J * lever;
    return (d.own + d.whole) * Mat3::Identity() - lever * (by_arm + d.orbit_share * by_lever) -
           arm * (by_arm + by_lever);
}

ContactRound::Row ContactRound::row_of(const ContactBodies& b, const ActiveContact& c, Which which) const {
    const auto began_at = [&](uint32_t i, const Vec3& arm, const Vec3& rolled) -> Vec3 {
        return b.moving[i].x - b.start_position[i] + rolled.cross(arm);
    };
    Row row;
    const uint32_t i = c.contact.a, j = c.contact.b;
    row.a = side_of(b, i, c.arm_a);
    row.rolled = turned(b, i);
    row.motion = began_at(i, c.arm_a, row.rolled);
    row.response = response_of(row.a);
    if (has_movable_b(c.contact)) {
        row.b = side_of(b, j, c.arm_b);
        const Vec3 rolled = turned(b, j);
        row.rolled -= rolled;
        row.motion -= began_at(j, c.arm_b, rolled);
        row.response += response_of(row.b);
    } else {
        row.motion -= c.collider_motion;
    }
    row.normal = c.contact.normal;
    row.along_normal = row.response * row.normal;
    row.inverse_mass = which == Which::last && !c.separate_pieces ? 0.0 : row.normal.dot(row.along_normal);
    row.gap = c.contact.gap, row.wanted_gap = c.wanted_gap;
    row.friction = c.friction, row.rolling_arm = c.rolling_arm;
    row.impulse = c.impulse;
    if (which != Which::first) row.impulse_before = c.impulse;
    return row;
}

void ContactRound::begin(const ContactBodies& b, const ContactIslands& islands, Which which, const WorkerPool& workers,
                         std::span<const ActiveContact> contacts) {
    islands_ = &islands;
    inverse_inertia_.resize(islands.piece.size());
    for (size_t k = 0; k < islands.piece.size(); ++k) inverse_inertia_[k] = b.pieces[islands.piece[k]].inverse_inertia;
    rows_.resize(contacts.size());
    workers.for_range(contacts.size(), kRowGrain, [&](size_t first, size_t end) {
        for (size_t k = first; k < end; ++k) rows_[k] = row_of(b, contacts[islands.contact[k]], which);
    });
    hinged_.resize(islands.size());
    for (size_t n = 0; n < islands.size(); ++n) hinged_[n] = contacts[islands.contact[islands.offset[n]]].has_hinges;
    now_.own.assign(islands.movable.size(), Vec3::Zero());
    now_.whole.assign(islands.piece.size(), PieceMotion());
    for (Motions* m : {&before_, &direction_}) {
        m->impulse.resize(rows_.size());
        m->own.resize(now_.own.size());
        m->whole.resize(now_.whole.size());
    }
    if (which == Which::first)
        for (const Row& row : rows_) move_by(row, row.impulse);
}

Vec3 ContactRound::moved(const Side& s) const {
    if (!s.moves) return Vec3::Zero();
    const PieceMotion& whole = now_.whole[s.piece];
    return now_.own[s.movable] + whole.shift + whole.turn.cross(s.division.lever) + whole.spin.cross(s.arm);
}

Vec3 ContactRound::motion(const Row& row) const { return row.motion + moved(row.a) - moved(row.b); }

void ContactRound::push_side(const Side& s, const Vec3& impulse) {
    if (!s.moves) return;
    const PushDivision& d = s.division;
    PieceMotion& whole = now_.whole[s.piece];
    const Mat3& J = inverse_inertia_[s.piece];
    const Vec3 by_arm = J * s.arm.cross(impulse), by_lever = J * d.lever.cross(impulse);
    now_.own[s.movable] += d.own * impulse;
    whole.shift += d.whole * impulse;
    whole.turn += by_arm + d.orbit_share * by_lever;
    whole.spin += by_arm + by_lever;
}

void ContactRound::turn_side(const Side& s, const Vec3& couple) {
    if (!s.moves) return;
    const Vec3 turn = inverse_inertia_[s.piece] * couple;
    now_.whole[s.piece].turn += turn;
    now_.whole[s.piece].spin += turn;
}

void ContactRound::move_by(const Row& row, const ContactImpulse& added) {
    const Vec3 impulse = added.normal * row.normal + added.friction;
    push_side(row.a, impulse), push_side(row.b, -impulse);
    turn_side(row.a, added.rolling), turn_side(row.b, -added.rolling);
}

void ContactRound::resist_rolling(Row& row) {
    Vec3 rolled = row.rolled;
    Mat3 inverse_inertia = Mat3::Zero();
    if (row.a.moves) rolled += now_.whole[row.a.piece].spin, inverse_inertia += inverse_inertia_[row.a.piece];
    if (row.b.moves) rolled -= now_.whole[row.b.piece].spin, inverse_inertia += inverse_inertia_[row.b.piece];
    const double length = rolled.norm();
    const Vec3 axis = length > kTiny ? Vec3(rolled / length) : Vec3::Zero();
    const double w = axis.dot(inverse_inertia * axis);
    const Vec3 wanted = w > 0 ? Vec3(-rolled / w) : Vec3::Zero();
    const Vec3 change = change_within(row.impulse.rolling, wanted, row.rolling_arm * row.impulse.normal);
    turn_side(row.a, change), turn_side(row.b, -change);
}

// One contact's turn in a pass: gap >= wanted_gap and friction within its cone. Returns the change of the gap, m.
double ContactRound::solve(Row& row) {
    if (!(row.inverse_mass > 0)) return 0;
    Vec3 moved_by = motion(row);
    const double gap = row.gap + row.normal.dot(moved_by);
    const double normal = std::max(row.impulse.normal + (row.wanted_gap - gap) / row.inverse_mass, 0.0);
    const double change = normal - row.impulse.normal;
    row.impulse.normal = normal;
    Vec3 impulse = change * row.normal;
    if (const double limit = row.friction * normal; limit > 0 || !row.impulse.friction.isZero(0)) {
        moved_by += change * row.along_normal;
        const Vec3 slip = moved_by - row.normal * row.normal.dot(moved_by);
        // Along the slip: slip / (d . K d), d its direction.
        const double squared = slip.squaredNorm(), along = slip.dot(row.response * slip);
        const Vec3 wanted = along > kTiny ? Vec3(-squared / along * slip) : Vec3::Zero();
        impulse += change_within(row.impulse.friction, wanted, limit);
    }
    if (!impulse.isZero(0)) push_side(row.a, impulse), push_side(row.b, -impulse);
    if (row.rolling_arm > 0) resist_rolling(row);
    return std::abs(change) * row.inverse_mass;
}

double ContactRound::pass_over(const Range& rows) {
    double largest = 0;
    for (uint32_t k = rows.begin; k < rows.end; ++k) largest = std::max(largest, solve(rows_[k]));
    return largest;
}

// Squared length of a change, as displacements weigh it, kg m2.
double ContactRound::size_of(const Row& row, const ContactImpulse& change) {
    const double arm = row.rolling_arm;
    const double rolling = arm > 0 ? change.rolling.squaredNorm() / (arm * arm) : 0;
    return row.inverse_mass * (change.normal * change.normal + change.friction.squaredNorm() + rolling);
}

// A pass is a step down the gradient; as much of the last direction is added to it as the steps' shrinking allows.
void ContactRound::relax_island(size_t island, double enough) {
    const Range rows{islands_->offset[island], islands_->offset[island + 1]};
    const Range movables{islands_->movable_offset[island], islands_->movable_offset[island + 1]};
    const Range pieces{islands_->piece_offset[island], islands_->piece_offset[island + 1]};
    const int passes = hinged_[island] ? kHingedPasses : kPasses;
    double last = 0;
    for (int pass = 0; pass < passes; ++pass) {
        for (uint32_t k = rows.begin; k < rows.end; ++k) before_.impulse[k] = rows_[k].impulse;
        for (uint32_t k = movables.begin; k < movables.end; ++k) before_.own[k] = now_.own[k];
        for (uint32_t k = pieces.begin; k < pieces.end; ++k) before_.whole[k] = now_.whole[k];
        if (pass_over(rows) < enough || pass + 1 == passes) return;
        double now = 0;
        for (uint32_t k = rows.begin; k < rows.end; ++k)
            now += size_of(rows_[k], rows_[k].impulse - before_.impulse[k]);
        const bool grows = pass > 0 && now > last;
        const double share = pass > 0 && !grows ? now / last : 0;
        last = now;
        const auto follow = [&]<class T>(T& io_value, T& io_direction, const T& before) {
            const T change = io_value - before;
            if (pass == 0 || grows) {
                io_direction = (grows ? 0.0 : 1.0) * change;
            } else {
                io_value = io_value + share * io_direction;
                io_direction = change + share * io_direction;
            }
        };
        for (uint32_t k = rows.begin; k < rows.end; ++k)
            follow(rows_[k].impulse, direction_.impulse[k], before_.impulse[k]);
        for (uint32_t k = movables.begin; k < movables.end; ++k) follow(now_.own[k], direction_.own[k], before_.own[k]);
        for (uint32_t k = pieces.begin; k < pieces.end; ++k)
            follow(now_.whole[k], direction_.whole[k], before_.whole[k]);
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
    for (size_t k = 0; k < islands_->movable.size(); ++k) io_push[islands_->movable[k]].own = now_.own[k];
    for (size_t k = 0; k < islands_->piece.size(); ++k) io_motion[islands_->piece[k]] = now_.whole[k];
    for (size_t place = 0; place < rows_.size(); ++place) {
        const Row& row = rows_[place];
        ActiveContact& c = io_contacts[islands_->contact[place]];
        const ContactImpulse given = row.impulse - row.impulse_before;
        const auto give = [&](uint32_t i, const Side& side, double sign) {
            if (!side.moves) return;
            const Vec3 impulse = sign * (given.normal * row.normal + given.friction);
            io_push[i].shift += b.inverse_mass[i] * impulse;
            io_push[i].torque += side.arm.cross(impulse) + sign * given.rolling;
        };
        give(c.contact.a, row.a, 1);
        if (has_movable_b(c.contact)) give(c.contact.b, row.b, -1);
        c.impulse = row.impulse;
        c.inverse_mass_normal = row.inverse_mass;
    }
}

}  // namespace sunder
