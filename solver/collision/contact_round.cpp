#include "solver/collision/contact_round.h"

#include <algorithm>
#include <cassert>
#include <functional>
#include <numeric>

#include "solver/instruction_set.h"

namespace sunder {
namespace {

constexpr int kPasses = 60, kHingedPasses = 12;
// The first passes, every so many, and those that find nothing left to do go over all contacts; the others over those
// that pushed in the last of these.
constexpr int kFirstFull = 2, kEveryFull = 4;
// Fewest contacts that threads are worth waking for: to solve, to set up, and to hand over what was solved.
constexpr size_t kGrain = 16, kRowGrain = 256, kHandOverGrain = 1024;
constexpr uint32_t kLanes = 4;
constexpr double kTiny = 1e-300;

const ContactKernels& kernels() {
#ifdef SUNDER_HAS_AVX2
    if (instruction_set() == InstructionSet::avx2) return kContactKernelsAvx2;
#endif
    return kContactKernelsPortable;
}

Vec3 vector(const double (&v)[3]) { return {v[0], v[1], v[2]}; }
Vec3 vector(const double (&v)[3][4], uint32_t lane) { return {v[0][lane], v[1][lane], v[2][lane]}; }
void put(const Vec3& v, double (&to)[3]) { std::copy_n(v.data(), 3, to); }
void put(const Vec3& v, uint32_t lane, double (*to)[4]) {
    for (int i = 0; i < 3; ++i) to[i][lane] = v[i];
}

// trace(-[u]x J [v]x): by how much an impulse at v turns what is at u, summed over three directions.
double trace_between(const RoundPiece& p, const Vec3& u, const Vec3& v) {
    const Vec3 Jv(p.Jxx * v.x() + p.Jxy * v.y() + p.Jxz * v.z(), p.Jxy * v.x() + p.Jyy * v.y() + p.Jyz * v.z(),
                  p.Jxz * v.x() + p.Jyz * v.y() + p.Jzz * v.z());
    return (p.Jxx + p.Jyy + p.Jzz) * u.dot(v) - u.dot(Jv);
}

}  // namespace

// Calls body(island) for each, the largest first, by whichever thread is free.
template <class Body>
void ContactRound::for_islands(const WorkerPool& workers, size_t grain, const Body& body) const {
    if (islands_->contact.size() < 2 * grain)
        std::ranges::for_each(by_size_, body);
    else
        workers.for_each(by_size_.size(), [&](size_t k) { body(by_size_[k]); });
}

void ContactRound::take_up_movables(const ContactBodies& b, const WorkerPool& workers) {
    const size_t n_movables = islands_->movable.size(), n_pieces = islands_->piece.size();
    movables_.assign(n_movables + islands_->size(), RoundMovable());
    began_.assign(movables_.size(), RoundBegan());
    pieces_.assign(n_pieces + islands_->size(), RoundPiece());
    for_islands(workers, kHandOverGrain, [&](uint32_t n) {
        for (uint32_t k = islands_->piece_offset[n]; k < islands_->piece_offset[n + 1]; ++k) {
            const Mat3& J = b.pieces[islands_->piece[k]].inverse_inertia;
            RoundPiece& p = pieces_[k];
            p.Jxx = J(0, 0), p.Jyy = J(1, 1), p.Jzz = J(2, 2);
            p.Jxy = J(0, 1), p.Jxz = J(0, 2), p.Jyz = J(1, 2);
        }
        for (uint32_t k = islands_->movable_offset[n]; k < islands_->movable_offset[n + 1]; ++k) {
            const uint32_t i = islands_->movable[k];
            const PushDivision division = divide_push(b, i);
            put(division.lever, movables_[k].lever);
            movables_[k].own = division.own, movables_[k].orbit_share = division.orbit_share;
            pieces_[islands_->piece_slot[b.piece[i]]].whole = division.whole;
            put(b.moving[i].x - b.start_position[i], began_[k].shift);
            put(turned(b, i), began_[k].turned);
        }
    });
}

// Whether a push there moves the rest of the piece, too, by so much that another in it has to know. What four side by
// side move each other by may not come near what each moves itself by: with 1 instead of a tenth, bodies tremble and do
// not fall asleep.
bool ContactRound::goes_with_its_piece(uint32_t movable, uint32_t piece, const Vec3& arm) const {
    constexpr double kLoose = 0.1;  // of the particle's own; summed over three directions
    const RoundMovable& m = movables_[movable];
    const RoundPiece& p = pieces_[piece];
    const Vec3 lever = vector(m.lever);
    const double shared = 3 * p.whole + trace_between(p, arm, arm) + 2 * trace_between(p, arm, lever) +
                          m.orbit_share * trace_between(p, lever, lever);
    return shared > kLoose * m.own;
}

BatchMember ContactRound::member_of(const ContactBodies& b, const ActiveContact& c) const {
    BatchMember member;
    if (which_ == Which::last && !c.separate_pieces) return member;
    member.kind = c.impulse.is_zero() ? BatchMember::Kind::idle : BatchMember::Kind::pushes;
    const auto touch = [&](uint32_t i, const Vec3& arm, size_t first) {
        if (!(b.inverse_mass[i] > 0)) return;
        const uint32_t movable = islands_->movable_slot[i], piece = islands_->piece_slot[b.piece[i]];
        member.touches[first] = movable;
        if (!b.pieces[b.piece[i]].rigid && goes_with_its_piece(movable, piece, arm))
            member.touches[first + 1] = static_cast<uint32_t>(movables_.size()) + piece;
    };
    touch(c.contact.a, c.arm_a, 0);
    if (has_movable_b(c.contact)) touch(c.contact.b, c.arm_b, 2);
    if (member.touches[3] == member.touches[1]) member.touches[3] = BatchMember::kNone;
    return member;
}

// What stays from round to round, but for the last.
void ContactRound::describe(const ContactBodies& b, std::span<const ActiveContact> contacts, size_t batch) {
    ContactBatch& to = contacts_[batch];
    const auto island =
        static_cast<uint32_t>(std::ranges::upper_bound(batches_.offset, batch) - batches_.offset.begin() - 1);
    const auto fixed_movable = static_cast<uint32_t>(islands_->movable.size() + island);
    const auto fixed_piece = static_cast<uint32_t>(islands_->piece.size() + island);
    for (uint32_t lane = 0; lane < kLanes; ++lane) {
        const auto take_up = [&](int side, uint32_t i, const Vec3& arm) {
            to.movable[side][lane] = islands_->movable_slot[i];
            to.piece[side][lane] = islands_->piece_slot[b.piece[i]];
            put(arm, lane, to.arm[side]);
        };
        for (int side : {0, 1}) to.movable[side][lane] = fixed_movable, to.piece[side][lane] = fixed_piece;
        const uint32_t place = batches_.member[kLanes * batch + lane];
        if (place == BatchMember::kNone) {
            const Vec3 none = Vec3::Zero();
            put(none, lane, to.arm[0]), put(none, lane, to.arm[1]), put(Vec3(Vec3::UnitZ()), lane, to.normal);
            put(none, lane, to.motion), put(none, lane, to.impulse), put(none, lane, to.impulse + 3);
            to.missing[lane] = to.normal_impulse[lane] = to.inverse_mass[lane] = 0;
            to.friction[lane] = to.rolling_arm[lane] = 0;
            continue;
        }
        const ActiveContact& c = contacts[islands_->contact[place]];
        take_up(0, c.contact.a, c.arm_a);
        if (has_movable_b(c.contact))
            take_up(1, c.contact.b, c.arm_b);
        else
            put(c.arm_b, lane, to.arm[1]);
        put(c.contact.normal, lane, to.normal);
        to.inverse_mass[lane] = 1;  // counts
        to.friction[lane] = c.friction;
        // What rolls on its own piece turns nothing.
        to.rolling_arm[lane] = to.piece[0][lane] == to.piece[1][lane] ? 0 : c.rolling_arm;
    }
}

void ContactRound::start(std::span<const ActiveContact> contacts, size_t batch) {
    ContactBatch& to = contacts_[batch];
    idle_[batch] = 1;
    for (uint32_t lane = 0; lane < kLanes; ++lane) {
        const uint32_t place = batches_.member[kLanes * batch + lane];
        if (place == BatchMember::kNone) continue;
        const ActiveContact& c = contacts[islands_->contact[place]];
        put(has_movable_b(c.contact) ? Vec3(Vec3::Zero()) : Vec3(-c.collider_motion), lane, to.motion);
        to.missing[lane] = c.wanted_gap - c.contact.gap;
        to.normal_impulse[lane] = c.impulse.normal;
        put(c.impulse.friction, lane, to.impulse), put(c.impulse.rolling, lane, to.impulse + 3);
        idle_[batch] &= c.impulse.is_zero();
    }
    std::fill_n(to.normal_change, kLanes, 0.0), std::fill_n(to.normal_direction, kLanes, 0.0);
    std::fill_n(to.change[0], 6 * kLanes, 0.0), std::fill_n(to.direction[0], 6 * kLanes, 0.0);
}

ContactArrays ContactRound::arrays() {
    return {movables_.data(), pieces_.data(), began_.data(), contacts_.data(), idle_.data()};
}

void ContactRound::begin(const ContactBodies& b, const ContactIslands& islands, Which which, const WorkerPool& workers,
                         std::span<const ActiveContact> contacts) {
    assert(which != Which::between || members_.size() == contacts.size());
    islands_ = &islands, which_ = which;
    if (which != Which::between) {
        by_size_.resize(islands.size());
        std::iota(by_size_.begin(), by_size_.end(), 0u);
        std::ranges::stable_sort(by_size_, std::greater(),
                                 [&](uint32_t n) { return islands.offset[n + 1] - islands.offset[n]; });
    }
    take_up_movables(b, workers);
    if (which != Which::between) {
        members_.resize(contacts.size());
        workers.for_range(contacts.size(), kRowGrain, [&](size_t first, size_t end) {
            for (size_t k = first; k < end; ++k) members_[k] = member_of(b, contacts[islands.contact[k]]);
        });
        batches_.form(members_, islands.offset, movables_.size() + pieces_.size(), workers);
        contacts_.resize(batches_.size()), idle_.resize(batches_.size());
        all_.resize(batches_.size()), active_.resize(batches_.size());
        std::iota(all_.begin(), all_.end(), 0u);
    }
    workers.for_range(batches_.size(), kRowGrain / kLanes, [&](size_t first, size_t end) {
        for (size_t k = first; k < end; ++k) {
            if (which != Which::between) describe(b, contacts, k);
            start(contacts, k);
        }
        if (which != Which::between) kernels().describe(arrays(), first, end);
        kernels().start(arrays(), first, end);
    });
    hinged_.resize(islands.size());
    for (size_t n = 0; n < islands.size(); ++n) hinged_[n] = contacts[islands.contact[islands.offset[n]]].has_hinges;
    if (which == Which::first)
        for_islands(workers, kHandOverGrain,
                    [&](uint32_t n) { kernels().give(arrays(), batches_.offset[n], batches_.offset[n + 1]); });
}

Vec3 ContactRound::moved(const ContactBatch& c, int side, uint32_t lane) const {
    const RoundMovable& m = movables_[c.movable[side][lane]];
    const RoundPiece& p = pieces_[c.piece[side][lane]];
    return vector(m.moved) + vector(p.shift) + vector(p.turn).cross(vector(m.lever)) +
           vector(p.spin).cross(vector(c.arm[side], lane));
}

Vec3 ContactRound::motion(size_t place) const {
    const uint32_t lane = batches_.lane[place] % kLanes;
    const ContactBatch& c = contacts_[batches_.lane[place] / kLanes];
    return vector(c.motion, lane) + moved(c, 0, lane) - moved(c, 1, lane);
}

void ContactRound::relax_island(size_t island, double enough) {
    const Range rows{batches_.offset[island], batches_.offset[island + 1]};
    const Range movables{islands_->movable_offset[island], islands_->movable_offset[island + 1]};
    const Range pieces{islands_->piece_offset[island], islands_->piece_offset[island + 1]};
    const size_t n_movables = movables.end - movables.begin, n_pieces = pieces.end - pieces.begin;
    double *const movable_before = &movable_before_[kMovedNumbers * movables.begin],
                  *const movable_direction = &movable_direction_[kMovedNumbers * movables.begin];
    double *const piece_before = &piece_before_[kPieceMovedNumbers * pieces.begin],
                  *const piece_direction = &piece_direction_[kPieceMovedNumbers * pieces.begin];
    const ContactKernels& kernel = kernels();
    const int passes = hinged_[island] ? kHingedPasses : kPasses;
    const std::span<const uint32_t> all = std::span(all_).subspan(rows.begin, rows.end - rows.begin);
    size_t n_active = 0;
    Following following{0, false};
    double last = 0;
    bool done = false;
    for (int pass = 0; pass < passes; ++pass) {
        kernel.follow_movables(&movables_[movables.begin], movable_before, movable_direction, n_movables, following);
        kernel.follow_pieces(&pieces_[pieces.begin], piece_before, piece_direction, n_pieces, following);
        const bool full = done || pass < kFirstFull || pass % kEveryFull == 0 || pass + 1 == passes;
        const PassResult result = full ? kernel.pass(arrays(), all.data(), all.size(), following)
                                       : kernel.pass(arrays(), &active_[rows.begin], n_active, following);
        if (full) {
            const auto last_active =
                std::ranges::copy_if(all, active_.begin() + rows.begin, [&](uint32_t k) { return !idle_[k]; }).out;
            n_active = static_cast<size_t>(last_active - active_.begin()) - rows.begin;
        }
        done = result.largest < enough;
        if (done && full) return;
        const bool grows = pass > 0 && result.size > last;
        following = {pass > 0 && !grows ? result.size / last : 0.0, !grows};
        last = std::max(result.size, kTiny);
    }
}

void ContactRound::relax(double enough, const WorkerPool& workers) {
    movable_before_.assign(kMovedNumbers * islands_->movable.size(), 0), movable_direction_ = movable_before_;
    piece_before_.assign(kPieceMovedNumbers * islands_->piece.size(), 0), piece_direction_ = piece_before_;
    for_islands(workers, kGrain, [&](uint32_t n) { relax_island(n, enough); });
}

ContactImpulse ContactRound::impulse_of(uint32_t place) const {
    const uint32_t lane = batches_.lane[place] % kLanes;
    const ContactBatch& c = contacts_[batches_.lane[place] / kLanes];
    return {c.normal_impulse[lane], Vec3(c.impulse[0][lane], c.impulse[1][lane], c.impulse[2][lane]),
            Vec3(c.impulse[3][lane], c.impulse[4][lane], c.impulse[5][lane])};
}

void ContactRound::end(const ContactBodies& b, const WorkerPool& workers, std::span<ActiveContact> io_contacts,
                       std::span<RoundPush> io_push, std::span<PieceMotion> io_motion) const {
    const auto end_contact = [&](uint32_t place) {
        ActiveContact& c = io_contacts[islands_->contact[place]];
        c.inverse_mass_normal = 0;
        if (batches_.lane[place] == BatchMember::kNone) return;
        c.inverse_mass_normal = contacts_[batches_.lane[place] / kLanes].inverse_mass[batches_.lane[place] % kLanes];
        const ContactImpulse now = impulse_of(place);
        const ContactImpulse given = which_ == Which::first ? now : now - c.impulse;
        c.impulse = now;
        if (given.is_zero()) return;
        const auto give = [&](uint32_t i, const Vec3& arm, double sign) {
            if (!(b.inverse_mass[i] > 0)) return;
            const Vec3 impulse = sign * (given.normal * c.contact.normal + given.friction);
            io_push[i].shift += b.inverse_mass[i] * impulse;
            io_push[i].torque += arm.cross(impulse) + sign * given.rolling;
        };
        give(c.contact.a, c.arm_a, 1);
        if (has_movable_b(c.contact)) give(c.contact.b, c.arm_b, -1);
    };
    for_islands(workers, kHandOverGrain, [&](uint32_t n) {
        for (uint32_t k = islands_->movable_offset[n]; k < islands_->movable_offset[n + 1]; ++k)
            io_push[islands_->movable[k]].own = vector(movables_[k].moved);
        for (uint32_t k = islands_->piece_offset[n]; k < islands_->piece_offset[n + 1]; ++k)
            io_motion[islands_->piece[k]] = {vector(pieces_[k].shift), vector(pieces_[k].turn),
                                             vector(pieces_[k].spin)};
        for (uint32_t place = islands_->offset[n]; place < islands_->offset[n + 1]; ++place) end_contact(place);
    });
}

}  // namespace sunder
