#include <cassert>
#include <cmath>
#include <functional>
#include <numeric>

#include "solver/collision/contact_round.h"

namespace sunder {
namespace {

constexpr uint32_t kLanes = kContactLanes;

float number(double x) { return static_cast<float>(x); }
void put(const Vec3& v, float (&to)[3]) {
    for (int i = 0; i < 3; ++i) to[i] = number(v[i]);
}

// The power of two next below; where there is none, 1.
double rounded_unit(double x) { return std::isnormal(x) ? std::ldexp(1.0, std::ilogb(x)) : 1.0; }

// trace(-[u]x J [v]x): by how much an impulse at v turns what is at u, summed over three directions.
double trace_between(const RoundPiece& p, const Vec3& u, const Vec3& v) {
    const Vec3 Jv(p.Jxx * v.x() + p.Jxy * v.y() + p.Jxz * v.z(), p.Jxy * v.x() + p.Jyy * v.y() + p.Jyz * v.z(),
                  p.Jxz * v.x() + p.Jyz * v.y() + p.Jzz * v.z());
    return (p.Jxx + p.Jyy + p.Jzz) * u.dot(v) - u.dot(Jv);
}

}  // namespace

void ContactRound::order_islands() {
    by_size_.resize(islands_->size());
    std::iota(by_size_.begin(), by_size_.end(), 0u);
    std::ranges::stable_sort(by_size_, std::greater(),
                             [&](uint32_t n) { return islands_->offset[n + 1] - islands_->offset[n]; });
}

ContactRound::Units ContactRound::units_of(const ContactBodies& b, uint32_t n) const {
    double lightest = 0;  // 1/kg
    for (uint32_t k = islands_->movable_offset[n]; k < islands_->movable_offset[n + 1]; ++k)
        lightest = std::max(lightest, b.inverse_mass[islands_->movable[k]]);
    return {length_, 1 / rounded_unit(lightest)};
}

void ContactRound::take_up_movables(const ContactBodies& b, const WorkerPool& workers) {
    const size_t n_movables = islands_->movable.size(), n_pieces = islands_->piece.size();
    movables_.assign(n_movables + islands_->size(), RoundMovable());
    began_.assign(movables_.size(), RoundBegan());
    pieces_.assign(n_pieces + islands_->size(), RoundPiece());
    division_.resize(n_movables), units_.resize(islands_->size());
    for_islands(workers, kHandOverGrain, [&](uint32_t n) {
        const Units units = units_[n] = units_of(b, n);
        const double per_length = 1 / units.length, inertia = units.mass * units.length * units.length;
        for (uint32_t k = islands_->piece_offset[n]; k < islands_->piece_offset[n + 1]; ++k) {
            const Mat3 J = inertia * b.pieces[islands_->piece[k]].inverse_inertia;
            RoundPiece& p = pieces_[k];
            p.Jxx = number(J(0, 0)), p.Jyy = number(J(1, 1)), p.Jzz = number(J(2, 2));
            p.Jxy = number(J(0, 1)), p.Jxz = number(J(0, 2)), p.Jyz = number(J(1, 2));
        }
        for (uint32_t k = islands_->movable_offset[n]; k < islands_->movable_offset[n + 1]; ++k) {
            const uint32_t i = islands_->movable[k];
            const PushDivision division = division_[k] = divide_push(b, i);
            put(per_length * division.lever, movables_[k].lever);
            movables_[k].own = number(units.mass * division.own);
            movables_[k].orbit_share = number(division.orbit_share);
            pieces_[islands_->piece_slot[b.piece[i]]].whole = number(units.mass * division.whole);
            const Vec3 shift = per_length * (b.moving[i].x - b.start_position[i]), turn = turned(b, i);
            for (int j = 0; j < 3; ++j) began_[k].shift[j] = shift[j], began_[k].turned[j] = number(turn[j]);
        }
    });
}

ContactRound::Gives ContactRound::how_it_gives(const ContactBodies& b, uint32_t n,
                                               std::span<const ActiveContact> contacts) const {
    if (contacts[islands_->contact[islands_->offset[n]]].has_hinges) return Gives::on_hinges;
    const uint32_t first = islands_->piece_offset[n], end = islands_->piece_offset[n + 1];
    const auto pieces = std::span(islands_->piece).subspan(first, end - first);
    return std::ranges::all_of(pieces, [&](uint32_t p) { return b.pieces[p].rigid; }) ? Gives::nowhere : Gives::softly;
}

void ContactRound::take_up_contacts(const ContactBodies& b, const WorkerPool& workers,
                                    std::span<const ActiveContact> contacts) {
    const size_t n_contacts = contacts.size(), n_islands = islands_->size();
    taken_.resize(n_contacts + n_islands), exact_.resize(n_contacts), separate_.resize(n_contacts);
    const double per_length = 1 / length_;
    const auto fixed = [&](uint32_t island) {
        RoundContact c;
        c.normal[2] = 1;
        for (int side : {0, 1}) {
            c.movable[side] = kMovableStride * static_cast<uint32_t>(islands_->movable.size() + island);
            c.piece[side] = kPieceStride * static_cast<uint32_t>(islands_->piece.size() + island);
        }
        return c;
    };
    for (uint32_t n = 0; n < n_islands; ++n) taken_[n_contacts + n] = fixed(n);
    for_places(workers, [&](size_t place, uint32_t island) {
        const ActiveContact& c = contacts[islands_->contact[place]];
        const double per_impulse = 1 / units_[island].impulse();
        RoundContact to = fixed(island);
        const auto take_up = [&](int side, uint32_t i) {
            to.movable[side] = kMovableStride * islands_->movable_slot[i];
            to.piece[side] = kPieceStride * islands_->piece_slot[b.piece[i]];
        };
        take_up(0, c.contact.a);
        if (has_movable_b(c.contact))
            take_up(1, c.contact.b);
        else
            put(-per_length * c.collider_motion, to.motion);
        put(c.contact.normal, to.normal), put(per_length * c.arm_a, to.arm_a), put(per_length * c.arm_b, to.arm_b);
        to.missing = number(per_length * (c.wanted_gap - c.contact.gap));
        to.friction = number(c.friction);
        // What rolls on its own piece turns nothing.
        to.rolling_arm = to.piece[0] == to.piece[1] ? 0 : number(per_length * c.rolling_arm);
        to.counts = 1;
        to.normal_impulse = number(per_impulse * c.impulse.normal);
        put(per_impulse * c.impulse.friction, to.friction_impulse);
        put(per_impulse * per_length * c.impulse.rolling, to.rolling_impulse);
        taken_[place] = to;
        exact_[place] = {c.contact.normal, c.arm_a, c.arm_b};
        separate_[place] = c.separate_pieces;
    });
    gives_.resize(n_islands);
    for (uint32_t n = 0; n < n_islands; ++n) gives_[n] = how_it_gives(b, n, contacts);
}

// Whether a push there moves the rest of the piece, too, by so much that another in it has to know. What eight side by
// side move each other by may not come near what each moves itself by: with 1 instead of a tenth, bodies tremble and do
// not fall asleep.
bool ContactRound::goes_with_its_piece(uint32_t movable, uint32_t piece, const float (&at)[3]) const {
    constexpr double kLoose = 0.04;  // of the particle's own; summed over three directions
    const RoundMovable& m = movables_[movable];
    const RoundPiece& p = pieces_[piece];
    const Vec3 lever = vector(m.lever), arm = vector(at);
    const double shared = 3 * p.whole + trace_between(p, arm, arm) + 2 * trace_between(p, arm, lever) +
                          m.orbit_share * trace_between(p, lever, lever);
    return shared > kLoose * m.own;
}

BatchMember ContactRound::member_of(const ContactBodies& b, size_t place) const {
    const RoundContact& c = taken_[place];
    BatchMember member;
    if (which_ == Which::last && !separate_[place]) return member;
    const auto is_zero = [](const float(&v)[3]) { return v[0] == 0 && v[1] == 0 && v[2] == 0; };
    const bool idle = c.normal_impulse == 0 && is_zero(c.friction_impulse) && is_zero(c.rolling_impulse);
    member.kind = idle ? BatchMember::Kind::idle : BatchMember::Kind::pushes;
    const auto touch = [&](int side, const float(&arm)[3]) {
        const uint32_t movable = c.movable[side] / kMovableStride, piece = c.piece[side] / kPieceStride;
        if (movable >= islands_->movable.size() || !(b.inverse_mass[islands_->movable[movable]] > 0)) return;
        member.touches[2 * side] = movable;
        if (!b.pieces[islands_->piece[piece]].rigid && goes_with_its_piece(movable, piece, arm))
            member.touches[2 * side + 1] = static_cast<uint32_t>(movables_.size()) + piece;
    };
    touch(0, c.arm_a), touch(1, c.arm_b);
    if (member.touches[3] == member.touches[1]) member.touches[3] = BatchMember::kNone;
    return member;
}

void ContactRound::form_batches(const ContactBodies& b, const WorkerPool& workers) {
    const auto n_contacts = static_cast<uint32_t>(islands_->contact.size());
    members_.resize(n_contacts);
    workers.for_range(n_contacts, kRowGrain, [&](size_t first, size_t end) {
        for (size_t k = first; k < end; ++k) members_[k] = member_of(b, k);
    });
    batches_.form(members_, islands_->offset, movables_.size() + pieces_.size(), workers);
    contacts_.resize(batches_.size()), starts_.resize(batches_.size()), idle_.resize(batches_.size());
    all_.resize(batches_.size()), active_.resize(batches_.size());
    std::iota(all_.begin(), all_.end(), 0u);
    taken_of_lane_ = batches_.member;
    for (uint32_t n = 0; n < islands_->size(); ++n)
        for (uint32_t k = kLanes * batches_.offset[n]; k < kLanes * batches_.offset[n + 1]; ++k)
            if (taken_of_lane_[k] == BatchMember::kNone) taken_of_lane_[k] = n_contacts + n;
}

ContactArrays ContactRound::arrays() {
    return {movables_.data(),      pieces_.data(), began_.data(),    taken_.data(),
            taken_of_lane_.data(), starts_.data(), contacts_.data(), idle_.data()};
}

void ContactRound::note_what_was_given(const WorkerPool& workers) {
    already_.resize(islands_->contact.size());
    for_places(workers, [&](size_t place, uint32_t) {
        const RoundContact& c = taken_[place];
        RoundImpulse& to = already_[place] = RoundImpulse();
        if (which_ == Which::first) return;
        to.normal = c.normal_impulse;
        std::ranges::copy(c.friction_impulse, to.friction), std::ranges::copy(c.rolling_impulse, to.rolling);
    });
}

// Passes have next to nothing left to do then where things are at rest.
void ContactRound::start_from_before(const WorkerPool& workers, std::span<const ActiveContact> contacts) {
    const double per_length = 1 / length_;
    for_places(workers, [&](size_t place, uint32_t island) {
        const ContactImpulse& before = contacts[islands_->contact[place]].before;
        const double per_impulse = 1 / units_[island].impulse();
        RoundContact& c = taken_[place];
        if (!separate_[place] || !(per_impulse * before.normal > c.normal_impulse)) return;
        c.normal_impulse = number(per_impulse * before.normal);
        put(per_impulse * before.friction, c.friction_impulse);
        put(per_impulse * per_length * before.rolling, c.rolling_impulse);
    });
}

// Moves things by what batches have more than was given already.
void ContactRound::give(const WorkerPool& workers) {
    const auto add = [&](float sign) {
        if (which_ == Which::first) return;
        for_places(workers, [&](size_t place, uint32_t) {
            if (batches_.lane[place] == BatchMember::kNone) return;
            const RoundImpulse& from = already_[place];
            ContactBatch& c = contacts_[batches_.lane[place] / kLanes];
            const uint32_t lane = batches_.lane[place] % kLanes;
            c.normal_impulse[lane] += sign * from.normal;
            for (int i = 0; i < 3; ++i)
                c.impulse[i][lane] += sign * from.friction[i], c.impulse[3 + i][lane] += sign * from.rolling[i];
        });
    };
    add(-1);
    for_islands(workers, kHandOverGrain,
                [&](uint32_t n) { contact_kernels().give(arrays(), batches_.offset[n], batches_.offset[n + 1]); });
    add(1);
}

void ContactRound::begin(const ContactBodies& b, const ContactIslands& islands, Which which, double length,
                         const WorkerPool& workers, std::span<const ActiveContact> contacts) {
    assert(which == Which::first || exact_.size() == contacts.size());
    islands_ = &islands, which_ = which, length_ = rounded_unit(length);
    if (which == Which::first) order_islands();
    take_up_movables(b, workers);
    if (which == Which::first) take_up_contacts(b, workers, contacts);
    note_what_was_given(workers);
    if (which == Which::last) start_from_before(workers, contacts);
    if (which != Which::between) form_batches(b, workers);
    workers.for_range(batches_.size(), kRowGrain / kLanes, [&](size_t first, size_t end) {
        if (which != Which::between) contact_kernels().describe(arrays(), first, end);
        contact_kernels().start(arrays(), first, end);
    });
    if (which != Which::between) give(workers);
}

}  // namespace sunder
