#include "solver/contacts/solve/contact_round.h"

#include "solver/lanes/instruction_set.h"

namespace sunder {
namespace {

// Of islands of rigid things, of those with soft pieces, and of those where something hangs on hinges; of the first
// round, those between and the last. What the last leaves undone sinks in. Soft pieces give way anyhow in the Newton
// step that follows a round; where there are none, all rounds are one.
constexpr int kPasses[3][3] = {{6, 0, 100}, {6, 6, 60}, {3, 3, 20}};
// The first passes, every so many, and those that find nothing left to do go over all contacts; the others over those
// that pushed in the last of these.
constexpr int kFirstFull = 2, kEveryFull = 4;
// Of what a movable was taken to resist a push with, besides its inertia. What a push is measured by is a guess, and
// the tip of a slender piece gives way by several times as much: matched without, it goes as far beyond the contact as
// it was before it, is taken back as a whole, stays bent, and is bent further in the next substep. With 1 some shots of
// stiff needles still go on like that; 3 to 30 do as well.
constexpr double kBrace = 3;
constexpr double kTiny = 1e-300;

Vec3 lane_of(const float (&v)[3][kContactLanes], uint32_t lane) { return {v[0][lane], v[1][lane], v[2][lane]}; }

}  // namespace

const ContactKernels& contact_kernels() { return SUNDER_BEST_KERNELS(kContactKernels); }

Vec3 ContactRound::moved(const ContactBatch& c, int side, uint32_t lane) const {
    const RoundMovable& m = movables_[c.movable[side][lane] / kMovableStride];
    const RoundPiece& p = pieces_[c.piece[side][lane] / kPieceStride];
    return vector(m.moved) + vector(p.shift) + vector(p.turn).cross(vector(m.lever)) +
           vector(p.spin).cross(lane_of(c.arm[side], lane));
}

Vec3 ContactRound::motion(size_t place) const {
    const uint32_t lane = batches_.lane[place] % kContactLanes;
    const ContactBatch& c = contacts_[batches_.lane[place] / kContactLanes];
    return length_ * (lane_of(c.motion, lane) + moved(c, 0, lane) - moved(c, 1, lane));
}

void ContactRound::relax(IslandId island, double enough) {
    enough /= length_;
    const Range rows{batches_.offset[island], batches_.offset[island + 1]};
    const Range movables{islands_->movable_offset[island], islands_->movable_offset[island + 1]};
    const Range pieces{islands_->piece_offset[island], islands_->piece_offset[island + 1]};
    const size_t n_movables = movables.end - movables.begin, n_pieces = pieces.end - pieces.begin;
    float *const movable_before = &movable_before_[kMovedNumbers * movables.begin],
                 *const movable_direction = &movable_direction_[kMovedNumbers * movables.begin];
    float *const piece_before = &piece_before_[kPieceMovedNumbers * pieces.begin],
                 *const piece_direction = &piece_direction_[kPieceMovedNumbers * pieces.begin];
    std::fill_n(movable_before, kMovedNumbers * n_movables, 0.0f);
    std::fill_n(movable_direction, kMovedNumbers * n_movables, 0.0f);
    std::fill_n(piece_before, kPieceMovedNumbers * n_pieces, 0.0f);
    std::fill_n(piece_direction, kPieceMovedNumbers * n_pieces, 0.0f);
    const ContactKernels& kernel = contact_kernels();
    const auto follow_pieces = gives_[island] == Gives::nowhere ? kernel.follow_rigid : kernel.follow_pieces;
    const int passes = kPasses[static_cast<int>(gives_[island])][static_cast<int>(which_)];
    const std::span<const uint32_t> all = std::span(all_).subspan(rows.begin, rows.end - rows.begin);
    size_t n_active = 0;
    Following following{0, false};
    double last = 0;
    bool done = false;
    for (int pass = 0; pass < passes; ++pass) {
        kernel.follow_movables(&movables_[movables.begin], movable_before, movable_direction, n_movables, following);
        follow_pieces(&pieces_[pieces.begin], piece_before, piece_direction, n_pieces, following);
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

// Of an island: what its contacts give to its movables.
void ContactRound::end_contacts(IslandId n) {
    for (uint32_t k = islands_->movable_offset[n]; k < islands_->movable_offset[n + 1]; ++k) given_[k] = Given();
    given_[islands_->movable.size() + n] = Given();
    for (uint32_t place = islands_->offset[n]; place < islands_->offset[n + 1]; ++place) {
        if (batches_.lane[place] == kNone) continue;
        const ContactBatch& from = contacts_[batches_.lane[place] / kContactLanes];
        const uint32_t lane = batches_.lane[place] % kContactLanes;
        RoundContact& c = taken_[place];
        const RoundImpulse& already = already_[place];
        c.normal_impulse = from.normal_impulse[lane];
        for (int i = 0; i < 3; ++i) {
            c.friction_impulse[i] = from.impulse[i][lane];
            c.rolling_impulse[i] = from.impulse[3 + i][lane];
        }
        Given &a = given_[c.movable[0] / kMovableStride], &b = given_[c.movable[1] / kMovableStride];
        a.normal += c.normal_impulse, b.normal += c.normal_impulse;
        const double normal = double{c.normal_impulse} - already.normal;
        const Vec3 friction = vector(c.friction_impulse) - vector(already.friction);
        const Vec3 rolling = vector(c.rolling_impulse) - vector(already.rolling);
        if (normal == 0 && friction.isZero(0) && rolling.isZero(0)) continue;
        const Exact& exact = exact_[place];
        const Vec3 impulse = normal * exact.normal + friction, couple = length_ * rolling;
        a.impulse += impulse, a.couple += exact.arm_a.cross(impulse) + couple;
        b.impulse -= impulse, b.couple -= exact.arm_b.cross(impulse) + couple;
    }
}

// What a held piece is pressed by moves with it: its mass is shared out to the particles that it presses on, as it
// presses on them. So a step of both together is what matching finds, whatever the round gave them.
void ContactRound::share_masses_out(IslandId n) {
    if (std::ranges::none_of(islands_->pieces_of(n), [&](uint32_t piece) { return b_.pieces[piece].is_held(); }))
        return;
    for (uint32_t place = islands_->offset[n]; place < islands_->offset[n + 1]; ++place) {
        const RoundContact& c = taken_[place];
        if (batches_.lane[place] == kNone || !(c.normal_impulse > 0)) continue;
        for (const int side : {0, 1}) {
            const uint32_t other = c.movable[1 - side] / kMovableStride;
            const double given_way =
                double{movables_[other].own} + double{pieces_[c.piece[1 - side] / kPieceStride].whole};
            given_[c.movable[side] / kMovableStride].met +=
                c.normal_impulse / given_[other].normal / std::max(given_way, kTiny);
        }
    }
}

void ContactRound::end(IslandId n, std::span<RoundPush> io_push, std::span<PieceMotion> io_motion,
                       std::span<double> io_brace) {
    end_contacts(n);
    if (which_ != Which::last) share_masses_out(n);
    // What passes have it move; of pieces in `turn` and `spin` first the angular impulses by arms and by levers.
    const double unit = units_[n].impulse();
    for (uint32_t k = islands_->movable_offset[n]; k < islands_->movable_offset[n + 1]; ++k) {
        const uint32_t i = islands_->movable[k];
        io_push[k] = RoundPush();
        if (!(b_.inverse_mass[i] > 0)) continue;
        const Vec3 impulse = unit * given_[k].impulse, couple = unit * given_[k].couple;
        const PushDivision& division = division_[k];
        PieceMotion& motion = io_motion[b_.piece[i]];
        motion.shift += division.whole * impulse;
        motion.turn += couple;
        motion.spin += division.lever.cross(impulse);
        io_push[k] = {division.own * impulse, b_.inverse_mass[i] * impulse, couple};
        const bool braced = which_ != Which::last && given_[k].normal > 0;
        io_brace[i] = braced ? kBrace * (b_.inverse_mass[i] / (division.own + division.whole) - 1) : 0;
        // No last round takes back what a held piece bends by: what it meets may keep it where it is as its mass can.
        if (b_.pieces[b_.piece[i]].is_held())
            io_brace[i] = std::min(io_brace[i], b_.inverse_mass[i] * units_[n].mass * given_[k].met);
    }
    for (uint32_t k = islands_->piece_offset[n]; k < islands_->piece_offset[n + 1]; ++k) {
        const ContactPiece& piece = b_.pieces[islands_->piece[k]];
        PieceMotion& motion = io_motion[islands_->piece[k]];
        const Vec3 by_arm = piece.inverse_inertia * motion.turn, by_lever = piece.inverse_inertia * motion.spin;
        motion.turn = by_arm + (piece.rigid ? 0.0 : 1 - piece.own_share) * by_lever;
        motion.spin = by_arm + by_lever;
    }
}

ContactImpulse ContactRound::impulse(IslandId island, size_t place) const {
    const RoundContact& c = taken_[place];
    const double unit = units_[island].impulse();
    return {unit * c.normal_impulse, unit * vector(c.friction_impulse), unit * length_ * vector(c.rolling_impulse)};
}

void ContactRound::set_impulse(IslandId island, size_t place, const ContactImpulse& impulse) {
    const ContactImpulse in_units = (1 / units_[island].impulse()) * impulse;
    RoundContact& c = taken_[place];
    c.normal_impulse = static_cast<float>(in_units.normal);
    for (int i = 0; i < 3; ++i) {
        c.friction_impulse[i] = static_cast<float>(in_units.friction[i]);
        c.rolling_impulse[i] = static_cast<float>(in_units.rolling[i] / length_);
    }
    const uint32_t lane = batches_.lane[place] % kContactLanes;
    ContactBatch& to = contacts_[batches_.lane[place] / kContactLanes];
    to.normal_impulse[lane] = c.normal_impulse;
    for (int i = 0; i < 3; ++i)
        to.impulse[i][lane] = c.friction_impulse[i], to.impulse[3 + i][lane] = c.rolling_impulse[i];
}

void ContactRound::hand_over(IslandId island, std::span<ActiveContact> io_contacts) const {
    const Range places = places_of(island);
    for (uint32_t place = places.begin; place < places.end; ++place) {
        ActiveContact& c = io_contacts[islands_->contact[place]];
        c.impulse = impulse(island, place);
        const uint32_t lane = batches_.lane[place];
        c.inverse_mass_normal =
            lane == kNone ? 0.0
                          : contacts_[lane / kContactLanes].inverse_mass[lane % kContactLanes] / units_[island].mass;
    }
}

}  // namespace sunder
