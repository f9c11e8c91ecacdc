#include <cmath>

#include "solver/contacts/solve/contact_round.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

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

ContactRound::Units ContactRound::units_of(IslandId island) const {
    double lightest = 0;  // 1/kg
    for (const MovableId i : islands_->movables_of(island)) lightest = std::max(lightest, b_.inverse_mass[i]);
    return {length_, 1 / rounded_unit(lightest)};
}

void ContactRound::take_up_movables(IslandId n) {
    const Units units = units_[n] = units_of(n);
    const double per_length = 1 / units.length, inertia = units.mass * units.length * units.length;
    movables_[islands_->movable.size() + n] = RoundMovable(), began_[islands_->movable.size() + n] = RoundBegan();
    pieces_[islands_->piece.size() + n] = RoundPiece();
    for (uint32_t k = islands_->piece_offset[n]; k < islands_->piece_offset[n + 1]; ++k) {
        const Mat3 J = inertia * b_.pieces[islands_->piece[k]].inverse_inertia;
        RoundPiece& p = pieces_[k] = RoundPiece();
        p.Jxx = number(J(0, 0)), p.Jyy = number(J(1, 1)), p.Jzz = number(J(2, 2));
        p.Jxy = number(J(0, 1)), p.Jxz = number(J(0, 2)), p.Jyz = number(J(1, 2));
    }
    for (uint32_t k = islands_->movable_offset[n]; k < islands_->movable_offset[n + 1]; ++k) {
        const MovableId i = islands_->movable[k];
        const PushDivision division = division_[k] = divide_push(b_, i);
        RoundMovable& m = movables_[k] = RoundMovable();
        put(per_length * division.lever, m.lever);
        m.own = number(units.mass * division.own);
        m.orbit_share = number(division.orbit_share);
        pieces_[islands_->piece_slot[b_.piece[i]]].whole = number(units.mass * division.whole);
        const Vec3 shift = per_length * (b_.moving[i].x - b_.start_position[i]), turn = turned(b_, i);
        RoundBegan& began = began_[k] = RoundBegan();
        for (int j = 0; j < 3; ++j) began.shift[j] = shift[j], began.turned[j] = number(turn[j]);
    }
}

ContactRound::Gives ContactRound::how_it_gives(IslandId n) const {
    if (from_[islands_->contact[islands_->offset[n]]].has_hinges) return Gives::on_hinges;
    const auto is_rigid = [&](PieceId p) { return b_.pieces[p].rigid; };
    return std::ranges::all_of(islands_->pieces_of(n), is_rigid) ? Gives::nowhere : Gives::softly;
}

void ContactRound::take_up_contacts(IslandId n) {
    const double per_length = 1 / length_, per_impulse = 1 / units_[n].impulse();
    RoundContact none;
    none.normal[2] = 1;
    for (int side : {0, 1}) {
        none.movable[side] = kMovableStride * static_cast<uint32_t>(islands_->movable.size() + n);
        none.piece[side] = kPieceStride * static_cast<uint32_t>(islands_->piece.size() + n);
    }
    taken_[islands_->contact.size() + n] = none;
    const Range places = places_of(n);
    for (uint32_t place = places.begin; place < places.end; ++place) {
        const ActiveContact& c = from_[islands_->contact[place]];
        RoundContact to = none;
        const auto take_up = [&](int side, MovableId i) {
            to.movable[side] = kMovableStride * islands_->movable_slot[i];
            to.piece[side] = kPieceStride * islands_->piece_slot[b_.piece[i]];
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
    }
    gives_[n] = how_it_gives(n);
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

BatchMember ContactRound::member_of(size_t place) const {
    const RoundContact& c = taken_[place];
    BatchMember member;
    if (which_ == Which::last && !separate_[place]) return member;
    const auto is_zero = [](const float(&v)[3]) { return v[0] == 0 && v[1] == 0 && v[2] == 0; };
    const bool idle = c.normal_impulse == 0 && is_zero(c.friction_impulse) && is_zero(c.rolling_impulse);
    member.kind = idle ? BatchMember::Kind::idle : BatchMember::Kind::pushes;
    const auto touch = [&](int side, const float(&arm)[3]) {
        const uint32_t movable = c.movable[side] / kMovableStride, piece = c.piece[side] / kPieceStride;
        if (movable >= islands_->movable.size() || !(b_.inverse_mass[islands_->movable[movable]] > 0)) return;
        member.touches[2 * side] = movable;
        if (!b_.pieces[islands_->piece[piece]].rigid && goes_with_its_piece(movable, piece, arm))
            member.touches[2 * side + 1] = static_cast<uint32_t>(movables_.size()) + piece;
    };
    touch(0, c.arm_a), touch(1, c.arm_b);
    if (member.touches[3] == member.touches[1]) member.touches[3] = kNone;
    return member;
}

void ContactRound::form_batches(IslandId n) {
    const Range places = places_of(n);
    for (uint32_t place = places.begin; place < places.end; ++place) members_[place] = member_of(place);
    batches_.form(n, std::span(members_).subspan(places.begin, places.end - places.begin), places.begin);
}

BatchForm ContactRound::form_of(uint32_t batch) const {
    const std::span<const uint32_t> places = std::span(batches_.member).subspan(kContactLanes * batch, kContactLanes);
    const auto moves_alone = [&](uint32_t piece) {
        return piece >= islands_->piece.size() || b_.pieces[islands_->piece[piece]].rigid;
    };
    const auto is_rigid = [&](uint32_t place) {
        const uint32_t(&piece)[2] = taken_[place].piece;
        return moves_alone(piece[0] / kPieceStride) && moves_alone(piece[1] / kPieceStride);
    };
    const auto end = std::ranges::find(places, kNone);  // lanes are filled from the first on
    const auto n = static_cast<size_t>(end - places.begin());
    const uint8_t width = n > kContactLanes / 2 ? kContactLanes : n > 1 ? kContactLanes / 2 : 1;
    return {width, std::all_of(places.begin(), end, is_rigid)};
}

void ContactRound::place_batches(IslandId n) {
    const Range places = places_of(n);
    batches_.place(n, places.begin, places.end);
    const auto none = static_cast<uint32_t>(islands_->contact.size()) + n;
    for (uint32_t k = kContactLanes * batches_.offset[n]; k < kContactLanes * batches_.offset[n + 1]; ++k)
        taken_of_lane_[k] = batches_.member[k] == kNone ? none : batches_.member[k];
    for (uint32_t k = batches_.offset[n]; k < batches_.offset[n + 1]; ++k) form_[k] = form_of(k);
}

ContactArrays ContactRound::arrays() {
    return {movables_.data(), pieces_.data(),   began_.data(), taken_.data(), taken_of_lane_.data(),
            starts_.data(),   contacts_.data(), idle_.data(),  form_.data()};
}

void ContactRound::note_what_was_given(IslandId n) {
    const Range places = places_of(n);
    for (uint32_t place = places.begin; place < places.end; ++place) {
        const RoundContact& c = taken_[place];
        RoundImpulse& to = already_[place] = RoundImpulse();
        if (which_ == Which::first) continue;
        to.normal = c.normal_impulse;
        std::ranges::copy(c.friction_impulse, to.friction), std::ranges::copy(c.rolling_impulse, to.rolling);
    }
}

// Passes have next to nothing left to do then where things are at rest.
void ContactRound::start_from_before(IslandId n) {
    const double per_length = 1 / length_, per_impulse = 1 / units_[n].impulse();
    const Range places = places_of(n);
    for (uint32_t place = places.begin; place < places.end; ++place) {
        const ContactImpulse& before = from_[islands_->contact[place]].before;
        RoundContact& c = taken_[place];
        if (!separate_[place] || !(per_impulse * before.normal > c.normal_impulse)) continue;
        c.normal_impulse = number(per_impulse * before.normal);
        put(per_impulse * before.friction, c.friction_impulse);
        put(per_impulse * per_length * before.rolling, c.rolling_impulse);
    }
}

// Moves things by what batches have more than was given already.
void ContactRound::give(IslandId n) {
    const Range places = places_of(n);
    const auto add = [&](float sign) {
        if (which_ == Which::first) return;
        for (uint32_t place = places.begin; place < places.end; ++place) {
            if (batches_.lane[place] == kNone) continue;
            const RoundImpulse& from = already_[place];
            ContactBatch& c = contacts_[batches_.lane[place] / kContactLanes];
            const uint32_t lane = batches_.lane[place] % kContactLanes;
            c.normal_impulse[lane] += sign * from.normal;
            for (int i = 0; i < 3; ++i)
                c.impulse[i][lane] += sign * from.friction[i], c.impulse[3 + i][lane] += sign * from.rolling[i];
        }
    };
    add(-1);
    contact_kernels().give(arrays(), batches_.offset[n], batches_.offset[n + 1]);
    add(1);
}

void ContactRound::open(const ContactBodies& bodies, const ContactIslands& islands, Which which, double length,
                        std::span<const ActiveContact> contacts) {
    SUNDER_ASSERT(which == Which::first || exact_.size() == contacts.size());
    SUNDER_ASSERT(length > 0 && islands.contact.size() == contacts.size());
    b_ = bodies, islands_ = &islands, which_ = which, from_ = contacts, length_ = rounded_unit(length);
    if (which == Which::between) return;
    const size_t n_contacts = contacts.size(), n_islands = islands.size();
    const size_t n_movables = islands.movable.size() + n_islands, n_pieces = islands.piece.size() + n_islands;
    movables_.resize(n_movables), began_.resize(n_movables), pieces_.resize(n_pieces);
    division_.resize(islands.movable.size()), units_.resize(n_islands), gives_.resize(n_islands);
    taken_.resize(n_contacts + n_islands), exact_.resize(n_contacts), separate_.resize(n_contacts);
    already_.resize(n_contacts), members_.resize(n_contacts);
    given_.resize(n_movables);
    movable_before_.resize(kMovedNumbers * islands.movable.size()), movable_direction_.resize(movable_before_.size());
    piece_before_.resize(kPieceMovedNumbers * islands.piece.size()), piece_direction_.resize(piece_before_.size());
    batches_.open(n_contacts, n_islands, n_movables + n_pieces);
}

void ContactRound::take_up(IslandId island) {
    SUNDER_ASSERT(island < units_.size());
    take_up_movables(island);
    if (which_ == Which::first) take_up_contacts(island);
    note_what_was_given(island);
    if (which_ == Which::last) start_from_before(island);
    if (which_ != Which::between) form_batches(island);
}

void ContactRound::lay_out() {
    if (which_ == Which::between) return;
    batches_.lay_out();
    const auto n = static_cast<uint32_t>(batches_.size());
    if (contacts_.size() < n)
        contacts_.resize(n), starts_.resize(n), idle_.resize(n), form_.resize(n), active_.resize(n),
            taken_of_lane_.resize(kContactLanes * n);
    for (uint32_t k = static_cast<uint32_t>(all_.size()); k < n; ++k) all_.push_back(k);
}

void ContactRound::start(IslandId island) {
    if (which_ != Which::between) place_batches(island);
    const size_t first = batches_.offset[island], end = batches_.offset[island + 1];
    if (which_ != Which::between) contact_kernels().describe(arrays(), first, end);
    contact_kernels().start(arrays(), first, end);
    if (which_ != Which::between) give(island);
}

}  // namespace sunder
