#include "solver/step/match.h"

#include <algorithm>
#include <cmath>

#include "solver/contacts/memory/contact_memory.h"
#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/matching/gauss_seidel.h"
#include "solver/material/bending_flow.h"
#include "solver/pieces/piece_motion.h"
#include "solver/pieces/push_division.h"
#include "solver/pieces/standing_loads.h"
#include "solver/scene/scales.h"
#include "solver/step/loops.h"
#include "solver/step/stopwatch.h"

namespace sunder {
namespace {

// A change of gap below these ends the passes: of the contact margin, and of the way that things fall in a step.
constexpr double kOfTheMargin = 1e-4, kOfTheFall = 0.003;
// Largest share of its way that a correction may end beyond the implicit step. With a third and more velocities grow
// from step to step; Poisson's ratio adds to the share.
constexpr double kFarthestBeyond = 0.2;

using Which = ContactRound::Which;
using How = StandingLoads::How;

// After n sweeps over-relaxed by w what is stiffest has (1 - w)^n of its way left: it lies beyond its goal where n is
// odd. A single sweep is not to go beyond it at all.
double steady_relaxation(const SolverSettings& settings) {
    const int n = settings.iterations;
    if (n == 1) return std::min(settings.over_relaxation, 1.0);
    if (n % 2 == 0) return settings.over_relaxation;
    return std::min(settings.over_relaxation, 1 + math::pow(kFarthestBeyond, 1.0 / n));
}

int newton_steps(const Pass& pass, const ContactProblem& problem, IslandId island) {
    return std::max(pass.context.settings.iterations, problem.loads.newton_steps[island]);
}

struct Round {
    Which which;
    int sweep;  // that follows one between two
};

bool is_left_out(const Pass& pass, const ContactProblem& problem, const Round& round, IslandId island) {
    const auto movables = problem.islands.movables_of(island);
    const std::vector<uint8_t>& kept = pass.slice.kept;
    const uint8_t is_kept = kept[movables.front()];  // all of it, or nothing
    SUNDER_ASSERT(std::ranges::all_of(movables, [&](MovableId i) { return kept[i] == is_kept; }));
    return is_kept || (round.which == Which::between && round.sweep >= newton_steps(pass, problem, island));
}

// How pushes divide, what contacts start from, and where things are.
void open_island(const Pass& pass, const Round& round, const LiveModel& model, IslandId island, ContactProblem& problem,
                 const Movables& movables, Pieces& pieces) {
    const StepContext& context = pass.context;
    const double h = pass.time.h;
    const ContactBodies bodies = bodies_of(movables, pieces);
    turn_pieces(context.scene.rest, model.live, problem.islands.pieces_of(island), movables, pieces);
    divide_pushes(context, h, round.which == Which::last, model, problem, island, pieces);
    // Sweeps, other than Newton steps, find what pushes did in where particles are.
    if (round.which == Which::first && context.settings.method == Method::projective)
        find_standing_loads(context, h, pass.state.strain, model, bodies, island, problem);
    if (round.which == Which::first)
        temper_warm_start(bodies, problem.islands, island, h, acceleration_of(context.input), pieces.motion,
                          problem.contacts);
    problem.round.take_up(island);
}

// What contacts push, until they want no more, and what that moves.
void solve_island(const Pass& pass, const Round& round, const LiveModel& model, IslandId island,
                  ContactProblem& problem, Movables& movables, Pieces& pieces) {
    const StepContext& context = pass.context;
    const SimulationMesh& rest = context.scene.rest;
    const double h = pass.time.h;
    const double enough =
        std::max(kOfTheMargin * context.contact_margin, kOfTheFall * fall_in_step(h, acceleration_of(context.input)));
    const bool last = round.which == Which::last;
    const How how = problem.loads.how[island];
    problem.round.start(island);
    const bool pushes =
        how == How::not_at_all || how == How::driven || (how == How::kept && round.which == Which::between);
    if (last || pushes) problem.round.relax(island, enough);
    problem.round.end(island, problem.pushes, pieces.motion, problem.brace);
    if (last) problem.round.hand_over(island, problem.contacts);
    if (last) note_what_pins_take(rest, h, model.live, problem, island, movables, pieces);
    const bool as_wholes = round.which == Which::first && context.settings.method == Method::projective;
    move_pieces(rest, model.live, problem, island, as_wholes, movables, pieces);
    if (!last && problem.loads.are_matched(island))
        brace_bearers(context, h, round.which == Which::first, model, island, pieces, problem, movables);
}

// A round over the contacts, the first with what they start from; the last: no shape matching follows. All of an island
// is done by one thread at a time.
void push_apart(const Pass& pass, const Round& round, const LiveModel& model, ContactProblem& problem,
                Movables& movables, Pieces& pieces) {
    const StepContext& context = pass.context;
    if (round.which == Which::first) problem.loads.open(problem.islands);
    problem.pushes.resize(problem.islands.movable.size());
    problem.round.open(bodies_of(movables, pieces), problem.islands, round.which, context.contact_margin,
                       problem.contacts);
    problem.islands.for_each(context.workers, [&](IslandId island) {
        if (!is_left_out(pass, problem, round, island))
            open_island(pass, round, model, island, problem, movables, pieces);
    });
    problem.round.lay_out();
    problem.islands.for_each(context.workers, [&](IslandId island) {
        if (!is_left_out(pass, problem, round, island))
            solve_island(pass, round, model, island, problem, movables, pieces);
    });
}

// All but the islands that take more Newton steps than that.
void leave_out_what_is_matched(const Pass& pass, int steps, const LiveTopology& live, const ContactProblem& problem,
                               const Pieces& pieces, Matching& matching) {
    std::vector<uint8_t> goes_on(pieces.whole.size(), 0);
    for (IslandId island(0); island < problem.islands.size(); ++island)
        for (const PieceId piece : problem.islands.pieces_of(island))
            goes_on[piece] = newton_steps(pass, problem, island) > steps;
    for_all(pass.context, pass.context.n_particles(), [&](size_t i) {
        if (!goes_on[pieces.of[i]]) matching.role[i] = Role::held;
    });
    for_pieces(live, kParticleGrain, pass.context.workers,
               [&](size_t piece) { matching.left_alone[piece] |= !goes_on[piece]; });
}

// Where pins hold a piece that is stiff it is where its velocities take it that a Newton step starts from, and not
// where it would fall to: among those that are pinned the others would be far out of shape, and what ends the step is
// measured by what it begins with. A plank of 5 GPa at rest fell by a millimetre in each step until it was felt, and
// sprang back.
void find_what_starts_unloaded(const Pass& pass, std::span<const uint8_t> smooth, const LiveModel& model,
                               const Pieces& pieces, Matching& matching) {
    matching.unloaded.resize(model.live.n_pieces());
    for_pieces(model.live, kParticleGrain, pass.context.workers, [&](size_t piece) {
        const auto particles = model.live.piece_particles(piece);
        matching.unloaded[piece] = pieces.held[piece] && !pass.slice.kept[particles.front()] &&
                                   !smooth[particles.front()] && !resolves_waves(model, particles, pass.time.h);
    });
}

SweepInput sweep_input(const SimulationMesh& rest, const LiveModel& model, const ContactProblem& problem,
                       const Matching& matching, const Movables& movables) {
    return {rest,
            model.live,
            model.shapes,
            model.stiffness,
            matching.role,
            movables.span,
            problem.brace,
            movables.tethers.stiffness,
            model.bending_shapes()};
}

// Of thin groups, what flows by the end of the step: no more than lasts of the last one's flow. Where Newton steps
// begin is not where things come to, and of what would flow there most never does. False where nothing may.
bool flows_within(const Pass& pass, const LiveModel& model, FlowWithin& o_flow) {
    if (model.thin.empty() || pass.flow_seconds == 0) return false;
    o_flow.yield = pass.state.yield, o_flow.layers = pass.state.layer_strain;
    o_flow.rate = pass.state.yielding_rate, o_flow.seconds = pass.flow_seconds;
    o_flow.share.clear();
    for (const Material& m : pass.context.input.materials) o_flow.share.push_back(flowing_share(m, pass.flow_seconds));
    return true;
}

void take_newton_step(const Pass& pass, int sweep, std::span<const uint8_t> smooth, const LiveModel& model,
                      const ContactProblem& problem, Matching& matching, Movables& movables, const Pieces& pieces) {
    const StepContext& context = pass.context;
    const auto starts_unloaded = [&](size_t g) {
        return matching.unloaded[model.live.piece(g)] && movables.role[g] == Role::free;
    };
    // What gravity, wind and drag add to its way.
    const auto fall_of = [&](size_t g) -> Vec3 {
        return pass.time.h * (movables.velocity[g] - pass.state.velocity[g]);
    };
    if (sweep == 0) {
        find_what_starts_unloaded(pass, smooth, model, pieces, matching);
        for_all(context, context.n_particles(), [&](size_t g) {
            if (!starts_unloaded(g)) return;
            movables.moving[g].x -= fall_of(g);
            movables.moving[g].x_inertial += problem.brace[g] * fall_of(g);  // braces hold where it was
        });
    }
    if (sweep == 0) start_in_shape(context, pass.time.h, model, pass.slice.kept, pieces, movables);
    SweepInput input = sweep_input(context.scene.rest, model, problem, matching, movables);
    if (flows_within(pass, model, matching.flow)) input.flow = &matching.flow;
    input.is_first = sweep == 0;
    matching.newton.apply(sweep == 0, input, context.workers, matching.goals, movables.moving);
    if (sweep > 0) return;
    for_all(context, context.n_particles(), [&](size_t g) {
        if (starts_unloaded(g)) movables.moving[g].x_inertial -= problem.brace[g] * fall_of(g);
    });
}

void match_shapes(const Pass& pass, int sweep, std::span<const uint8_t> smooth, const LiveModel& model,
                  ContactProblem& problem, Matching& matching, Movables& movables, Pieces& pieces) {
    const StepContext& context = pass.context;
    const SolverSettings& settings = context.settings;
    const SimulationMesh& rest = context.scene.rest;
    if (settings.method == Method::gauss_seidel) {
        std::vector<double> k;  // by material
        for (const Material& m : context.input.materials) k.push_back(m.stiffness);
        return gauss_seidel_sweep(rest, model.live, model.shapes, k, matching.role, movables.moving, matching.goals);
    }

    for_all(context, context.n_particles(), [&](size_t g) {  // a lone one matches itself wherever it is
        if (model.live.count(g) == 1) matching.goals[g].rotation = movables.moving[g].d;
    });
    if (settings.method == Method::projective)
        take_newton_step(pass, sweep, smooth, model, problem, matching, movables, pieces);
    else
        matching.jacobi.apply({sweep, settings.iterations, steady_relaxation(settings), pieces.is_touched},
                              sweep_input(rest, model, problem, matching, movables), context.workers, matching.goals,
                              movables.moving);
    problem.islands.for_each(context.workers, [&](IslandId island) {
        if (problem.loads.are_matched(island) && sweep < newton_steps(pass, problem, island))
            pass_loads_on(rest, model.live, island, problem, movables, pieces);
    });
    for_piece_ranges(model.live, kParticleGrain, context.workers, [&](size_t first, size_t last) {
        restore_linear_momentum(rest, model.live, matching.left_alone, first, last, movables.moving);
    });
}

}  // namespace

void leave_alone(const Pass& pass, const Movables& movables, Matching& matching) {
    matching.role.resize(pass.context.n_particles());
    for_all(pass.context, matching.role.size(),
            [&](size_t i) { matching.role[i] = pass.slice.kept[i] ? Role::held : movables.role[i]; });
}

void leave_pieces_alone(const Pass& pass, const LiveTopology& live, const Pieces& pieces, Matching& matching) {
    matching.left_alone.resize(live.n_pieces());
    for_pieces(live, kParticleGrain, pass.context.workers, [&](size_t piece) {
        matching.left_alone[piece] = pieces.held[piece] | pass.slice.kept[live.piece_particles(piece).front()];
    });
}

void correct(const Pass& pass, std::span<const uint8_t> smooth, LiveModel& model, ContactProblem& problem,
             Matching& matching, Movables& movables, Pieces& pieces, StepReport& report) {
    const auto push = [&](Which which, int sweep) {
        Stopwatch watch(report.contact_s);
        push_apart(pass, {which, sweep}, model, problem, movables, pieces);
    };
    const auto match = [&](int sweep) {
        Stopwatch watch(report.shape_s);
        match_shapes(pass, sweep, smooth, model, problem, matching, movables, pieces);
    };
    const int iterations = pass.context.settings.iterations;
    model.take_up_bending(pass.context.scene.rest, pass.state, pass.context.workers);
    push(Which::first, 0);
    match(0);
    int most = iterations;
    for (const int steps : problem.loads.newton_steps) most = std::max(most, steps);
    for (int sweep = 1; sweep < most; ++sweep) {
        push(Which::between, sweep);
        if (sweep >= iterations) leave_out_what_is_matched(pass, sweep, model.live, problem, pieces, matching);
        match(sweep);
    }
    push(Which::last, 0);
}

}  // namespace sunder
