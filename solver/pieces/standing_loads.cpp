#include "solver/pieces/standing_loads.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/scene/scales.h"

namespace sunder {
namespace {

// Of the last force, but for what is matched together. It follows the deformation by a substep: with nine tenths a
// soft thing swings for ever on another, with none it sinks in by up to a quarter more than it should.
constexpr double kKept = 0.75;
// A load on a free piece sinks in by so little, of what falls in a substep, that it lies as on something rigid. What is
// left of a Newton step shakes so firm a piece on its ground.
constexpr double kFirm = 100;
// Of its weight, what is taken to press on each particle in reach of a load besides what did: those that carried
// nothing in the last substep would spring back alone and throw it.
constexpr double kEvenly = 1;
// Of a particle's mass and what its groups hold it with: the ground then gives by a thirtieth of what they do.
// With 100 what is left of a Newton step is felt, with 10 it sinks in.
constexpr double kGround = 30;
// Of what the masses of the ground say that it gave to a free piece, what its momentum may say at most.
constexpr double kMostOfGround = 2;
// Where several pieces give, and where what gives is crushed: strained by more than kCrushed. Of 400 heaps of soft and
// rigid things 12 tremble with two Newton steps, nine of which are crushed, and 5 so.
constexpr int kNewtonSteps = 4;
// Where something is driven into what pins hold. With one step, before which a single round tells who presses, four of
// 24 heavy things were thrown out with 1.15 to 20 times their energy, which is not so with two.
constexpr int kDrivenSteps = 2;
// Of the contact margin, what parts two things that still press; of what is driven, what counts as weight where nothing
// falls.
constexpr double kSlight = 0.3;
constexpr double kCrushed = 0.2;
constexpr double kTrembling = 3;  // what is crushed trembles by as many times the speed of what stands

bool gives(const ContactBodies& b, uint32_t i) { return b.inverse_mass[i] > 0 && !b.pieces[b.piece[i]].rigid; }
bool is_ground(const ContactBodies& b, uint32_t i) { return i == Contact::kStatic || !(b.inverse_mass[i] > 0); }

// Of a contact, what it presses together; b may be a collider.
uint32_t side_b(const Contact& c) { return has_movable_b(c) ? c.b : Contact::kStatic; }
uint32_t bearer(const Contact& c, const Bearing& at) { return at.of_a ? c.a : side_b(c); }
uint32_t other(const Contact& c, const Bearing& at) { return at.of_a ? side_b(c) : c.a; }

// m/s; a fall by half of the smallest fragment; `least`: where that is less.
double standing_speed(const StepContext& context, double least, std::span<const MovableId> movables) {
    double volume = std::numeric_limits<double>::max();
    for (const MovableId i : movables)
        if (i < context.scene.rest.n_particles()) volume = std::min(volume, context.scene.rest.volume[i]);
    return std::max(least, speed_of_fall(math::cbrt(volume), acceleration_of(context.input)));
}

Vec3 motion_of_ground(const ActiveContact& c, uint32_t ground, const Movables& movables) {
    return ground == Contact::kStatic ? c.collider_motion
                                      : Vec3(movables.moving[ground].x - movables.start_position[ground]);
}

// Calls body(place, contact, bearing) for the island's contacts.
template <class Body>
void for_places(ContactProblem& problem, IslandId island, const Body& body) {
    for (uint32_t place = problem.islands.offset[island]; place < problem.islands.offset[island + 1]; ++place)
        body(place, problem.contacts[problem.islands.contact[place]], problem.loads.bearings[place]);
}

// Fills `of` and `of_a` of the bearings of an island in which one piece gives. Whether there are loads: what it holds
// up or, where they are `driven` into it, whatever may come to touch it.
bool find_bearings(const StepContext& context, double h, bool driven, const LiveModel& model, const ContactBodies& b,
                   IslandId island, ContactProblem& problem) {
    const Vec3 down = FieldsOfForce(context.input).acceleration;
    const auto of = [&](uint32_t i) -> StandingLoads::OfMovable& {
        return problem.loads.movables[problem.islands.movable_slot[i]];
    };
    for (const MovableId i : problem.islands.movables_of(island)) of(i) = StandingLoads::OfMovable();
    for_places(problem, island, [&](uint32_t, ActiveContact& c, Bearing& o_at) {
        o_at = Bearing();
        const uint32_t a = c.contact.a, o = side_b(c.contact);
        const bool grounded = is_ground(b, a) || is_ground(b, o);
        const bool a_gives = gives(b, a), b_gives = !is_ground(b, o) && gives(b, o);
        o_at.of_a = a_gives;
        if (a_gives != b_gives && !(driven && grounded)) o_at.of = grounded ? Bearing::Of::ground : Bearing::Of::load;
        const bool presses = c.before.normal > 0 || (driven && c.restitution == 0);
        if (!presses || a_gives == b_gives) {
            if (c.before.normal > 0 && grounded)
                for (const uint32_t i : {a, o})
                    if (!is_ground(b, i))
                        of(i).is_load = driven,
                        of(i).grounded += (i == a ? 1.0 : -1.0) * c.before.normal * c.contact.normal;
            return;
        }
        if (grounded) return;
        StandingLoads::OfMovable& load = of(other(c.contact, o_at));
        load.on = b.piece[bearer(c.contact, o_at)];
        load.pull += sum_of_pulls(model, h, bearer(c.contact, o_at)) / b.inverse_mass[bearer(c.contact, o_at)];
        load.held_up += (a_gives ? -1.0 : 1.0) * (c.before.normal * c.contact.normal + c.before.friction);
    });
    bool any = false;
    for_places(problem, island, [&](uint32_t, ActiveContact& c, Bearing& io_at) {
        if (io_at.of != Bearing::Of::load) return;
        const StandingLoads::OfMovable& load = of(other(c.contact, io_at));
        // What is squeezed against ground goes nowhere.
        const bool stays = driven ? load.held_up.dot(load.grounded) < 0 : load.held_up.dot(down) >= 0;
        if (!load.is_load || load.on.is_none() || stays)
            io_at.of = Bearing::Of::nothing;
        else
            any |= b.pieces[load.on].is_held() || load.pull * b.inverse_mass[other(c.contact, io_at)] < kFirm;
    });
    return any;
}

bool is_crushed(const LiveTopology& live, const ContactBodies& b, std::span<const PieceId> pieces,
                std::span<const double> strain) {
    return std::ranges::any_of(pieces, [&](PieceId p) {
        return !b.pieces[p].rigid &&
               std::ranges::any_of(live.piece_particles(p), [&](uint32_t j) { return strain[j] > kCrushed; });
    });
}

}  // namespace

void StandingLoads::open(const ContactIslands& islands) {
    how.assign(islands.size(), How::not_at_all), newton_steps.assign(islands.size(), 1);
    bearings.resize(islands.contact.size()), movables.resize(islands.movable.size());
    pieces.resize(islands.piece.size());
}

void find_standing_loads(const StepContext& context, double h, std::span<const double> strain, const LiveModel& model,
                         const ContactBodies& b, IslandId island, ContactProblem& problem) {
    SUNDER_ASSERT(h > 0 && island < problem.loads.how.size() && strain.size() == context.scene.rest.n_particles());
    using How = StandingLoads::How;
    bool any = false;
    double approach = 0;
    for (const ContactId k : problem.islands.contacts_of(island)) {
        const ActiveContact& c = problem.contacts[k];
        if (c.has_hinges) return;
        any |= c.before.normal > 0;
        approach = std::max(approach, c.approach_speed);
    }
    const auto give =
        std::ranges::count_if(problem.islands.pieces_of(island), [&](uint32_t p) { return !b.pieces[p].rigid; });
    if (give == 0) return;
    const double resting = resting_speed(h, acceleration_of(context.input));
    const double standing = standing_speed(context, resting, problem.islands.movables_of(island));
    How& how = problem.loads.how[island];
    int& steps = problem.loads.newton_steps[island];
    if (any && approach <= kTrembling * standing &&
        is_crushed(model.live, b, problem.islands.pieces_of(island), strain))
        steps = kNewtonSteps;
    const bool stands = any && approach <= standing;
    if (stands && give > 1) steps = kNewtonSteps;
    const bool held =
        std::ranges::any_of(problem.islands.pieces_of(island), [&](uint32_t p) { return b.pieces[p].is_held(); });
    if (stands && give == 1 && find_bearings(context, h, false, model, b, island, problem))
        how = How::together;
    else if (give == 1 && held && find_bearings(context, h, true, model, b, island, problem))
        how = How::driven, steps = std::max(steps, kDrivenSteps);
    else if (any && approach <= resting && std::max(context.settings.iterations, steps) > 1)
        how = How::kept;
    if (how == How::not_at_all) return;
    for_places(problem, island, [&](uint32_t, ActiveContact& c, const Bearing& at) {
        if (problem.loads.are_matched(island) && at.of != Bearing::Of::nothing) {
            c.impulse = ContactImpulse();
            if (how == How::driven) c.restitution = 0;
        } else if (how != How::driven)
            c.impulse = kKept * c.before;
    });
}

void brace_bearers(const StepContext& context, double h, bool first, const LiveModel& model, IslandId island,
                   const Pieces& pieces, ContactProblem& problem, Movables& movables) {
    const std::vector<double>& inverse_mass = movables.inverse_mass;
    const auto of = [&](uint32_t i) -> StandingLoads::OfMovable& {
        return problem.loads.movables[problem.islands.movable_slot[i]];
    };
    for (const MovableId i : problem.islands.movables_of(island)) of(i) = StandingLoads::OfMovable();
    const bool driven = problem.loads.how[island] == StandingLoads::How::driven;
    const double fall = kEvenly * fall_in_step(h, acceleration_of(context.input)),
                 evenly = driven ? std::max(fall, kSlight * context.contact_margin) : fall;  // m
    for_places(problem, island, [&](uint32_t place, ActiveContact& c, Bearing& io_at) {
        if (io_at.of == Bearing::Of::nothing) return;
        io_at.mass = problem.round.pressure(island, place);
        if (first) io_at.mass = std::max(io_at.mass, c.before.normal);
        if (io_at.of != Bearing::Of::load) return;
        const uint32_t load = other(c.contact, io_at);
        // What swings away would go on as if the load went with it.
        if (driven && c.contact.gap + c.contact.normal.dot(problem.round.motion(place)) > c.wanted_gap + evenly) {
            io_at.mass = 0;
            return;
        }
        io_at.mass += evenly / inverse_mass[load];
        of(load).pressure += io_at.mass;
        const Vec3 by = (io_at.of_a ? -io_at.mass : io_at.mass) * c.contact.normal;
        of(load).impulse += by, of(load).torque += (io_at.of_a ? c.arm_b : c.arm_a).cross(by);
    });
    // A load whose bearings turn it, too, resists with less than its mass.
    for (const MovableId i : problem.islands.movables_of(island)) {
        StandingLoads::OfMovable& load = of(i);
        if (!(load.pressure > 0)) continue;
        const Vec3 push = load.impulse / load.pressure, couple = load.torque / load.pressure;
        const double least = inverse_mass[i];
        load.resists = 1 / std::max(least, least * push.squaredNorm() +
                                               couple.dot(pieces.whole[pieces.of[i]].inverse_inertia * couple));
        load.impulse = load.torque = Vec3::Zero();
    }
    for_places(problem, island, [&](uint32_t, ActiveContact& c, Bearing& io_at) {
        if (!(io_at.mass > 0)) return;
        const uint32_t i = bearer(c.contact, io_at), o = other(c.contact, io_at);
        const bool on_ground = io_at.of == Bearing::Of::ground;
        io_at.mass = on_ground ? kGround * (1 + sum_of_pulls(model, h, i)) / inverse_mass[i]
                               : io_at.mass / of(o).pressure * of(o).resists;
        of(i).mass += io_at.mass;
        if (!on_ground) return;
        const Vec3& n = c.contact.normal;
        const Vec3 way = motion_of_ground(c, o, movables) - (movables.moving[i].x - movables.start_position[i]);
        of(i).ground += io_at.mass, of(i).to_ground += io_at.mass * n.dot(way) * n;
    });
    for (const MovableId i : problem.islands.movables_of(island)) {
        StandingLoads::OfMovable& m = of(i);
        if (!(m.mass > 0)) continue;
        problem.brace[i] = inverse_mass[i] * m.mass;
        if (first && m.ground > 0) movables.moving[i].x += m.to_ground / m.ground;
        m.begin = movables.moving[i].x;
    }
}

namespace {

// What a bearing pushes with when the Newton step is over: its masses resisted, as far as something is pushed and
// friction holds.
ContactImpulse resisted(const ActiveContact& c, const Bearing& at, const ContactImpulse& had, const Vec3& way) {
    const Vec3& n = c.contact.normal;
    const Vec3 by = (at.of_a ? -at.mass : at.mass) * way;
    ContactImpulse now = had;
    now.normal = std::max(had.normal + n.dot(by), 0.0);
    now.friction += by - n.dot(by) * n;
    if (const double held = c.friction * now.normal, all = now.friction.norm(); all > held) now.friction *= held / all;
    return now;
}

Vec3 force_of(const ContactImpulse& impulse, const Vec3& normal) { return impulse.normal * normal + impulse.friction; }

// The ground's mass is so large that what is left of a Newton step would be felt: what the ground gave to a free piece
// in all is told by its momentum.
void find_shares(const SimulationMesh& rest, const LiveTopology& live, const ContactIslands& islands, IslandId island,
                 const Movables& movables, const Pieces& pieces, StandingLoads& loads) {
    for (const PieceId p : islands.pieces_of(island)) {
        StandingLoads::OfPiece& of = loads.pieces[islands.piece_slot[p]];
        of.share = 1;
        if (pieces.whole[p].rigid || pieces.whole[p].is_held() || of.by_ground.isZero(0)) continue;
        Vec3 all = Vec3::Zero();
        for (const ParticleId j : live.piece_particles(p))
            all += rest.mass[j] * (movables.moving[j].x - movables.moving[j].x_inertial);
        of.share = std::clamp(of.by_ground.dot(all - of.by_loads) / of.by_ground.squaredNorm(), 0.0, kMostOfGround);
    }
}

}  // namespace

void pass_loads_on(const SimulationMesh& rest, const LiveTopology& live, IslandId island, ContactProblem& problem,
                   Movables& movables, Pieces& pieces) {
    const std::vector<double>& inverse_mass = movables.inverse_mass;
    const auto of_piece = [&](uint32_t i) -> StandingLoads::OfPiece& {
        return problem.loads.pieces[problem.islands.piece_slot[pieces.of[i]]];
    };
    const auto load_of = [&](const ActiveContact& c, const Bearing& at) -> StandingLoads::OfMovable& {
        return problem.loads.movables[problem.islands.movable_slot[other(c.contact, at)]];
    };
    for (const PieceId p : problem.islands.pieces_of(island)) problem.loads.pieces[problem.islands.piece_slot[p]] = {};
    for_places(problem, island, [&](uint32_t place, ActiveContact& c, Bearing& io_at) {
        if (!(io_at.mass > 0)) return;
        const uint32_t i = bearer(c.contact, io_at);
        const Vec3& begin = problem.loads.movables[problem.islands.movable_slot[i]].begin;
        const Vec3 way = movables.moving[i].x - begin;
        const ContactImpulse had = problem.round.impulse(island, place), now = resisted(c, io_at, had, way);
        io_at.given = force_of(now, c.contact.normal) - force_of(had, c.contact.normal);
        if (io_at.of == Bearing::Of::ground) return;
        StandingLoads::OfMovable& load = load_of(c, io_at);
        const Vec3 back = io_at.of_a ? Vec3(-io_at.given) : io_at.given;
        const Vec3& arm = io_at.of_a ? c.arm_b : c.arm_a;
        load.impulse += back, load.torque += arm.cross(back);
        load.work += back.squaredNorm() / io_at.mass;
        load.inertia += io_at.mass * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    });
    // What is rigid goes with that at once. It turns by less than it was given, as bearings at its corners turn harder
    // than it does: by all of it, it would leave them behind. And it takes no more than what it gains no energy by.
    for (const MovableId i : problem.islands.movables_of(island)) {
        StandingLoads::OfMovable& load = problem.loads.movables[problem.islands.movable_slot[i]];
        if (load.impulse.isZero(0) && load.torque.isZero(0)) continue;
        ContactPiece& piece = pieces.whole[pieces.of[i]];
        const Mat3 own = piece.inverse_inertia.inverse();
        const Vec3 turn = (own + load.inertia).inverse() * load.torque;
        const double energy = inverse_mass[i] * load.impulse.squaredNorm() + turn.dot(own * turn);
        load.share = std::min(1.0, load.work / energy);
        movables.moving[i].x += load.share * inverse_mass[i] * load.impulse;
        piece.turned += load.share * turn, movables.push[i].torque += load.share * own * turn;
    }
    for_places(problem, island, [&](uint32_t, ActiveContact& c, Bearing& io_at) {
        if (!(io_at.mass > 0)) return;
        const bool on_ground = io_at.of == Bearing::Of::ground;
        if (!on_ground) io_at.given *= load_of(c, io_at).share;
        StandingLoads::OfPiece& of = of_piece(bearer(c.contact, io_at));
        (on_ground ? of.by_ground : of.by_loads) += io_at.of_a ? io_at.given : Vec3(-io_at.given);
    });
    find_shares(rest, live, problem.islands, island, movables, pieces, problem.loads);
    for_places(problem, island, [&](uint32_t place, ActiveContact& c, const Bearing& at) {
        if (!(at.mass > 0)) return;
        const uint32_t i = bearer(c.contact, at), o = other(c.contact, at);
        const bool on_ground = at.of == Bearing::Of::ground;
        const Vec3& n = c.contact.normal;
        const Vec3 given = (on_ground ? of_piece(i).share : 1.0) * at.given;
        ContactImpulse now = problem.round.impulse(island, place);
        now.normal += n.dot(given), now.friction += given - n.dot(given) * n;
        problem.round.set_impulse(island, place, now);
        const auto push = [&](uint32_t j, const Vec3& impulse) {
            const Vec3 shift = inverse_mass[j] * impulse;
            movables.moving[j].x_inertial += shift, movables.push[j].shift += shift;
        };
        const Vec3 to = at.of_a ? given : Vec3(-given);
        push(i, to), movables.push[i].torque += (at.of_a ? c.arm_a : c.arm_b).cross(to);
        if (!on_ground) push(o, -to);
    });
}

}  // namespace sunder
