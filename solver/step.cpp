#include "solver/step.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/matching/gauss_seidel.h"
#include "solver/matching/thin_groups.h"
#include "solver/piece_motion.h"
#include "solver/scene/ring_check.h"
#include "solver/substep.h"

namespace sunder {
namespace {

constexpr double kRunawaySpeed = 1e5;  // m/s; nothing that an artist animates is faster: numbers went bad
// Largest share of its way that a correction may end beyond the implicit step. With a third and more velocities grow
// from substep to substep; Poisson's ratio adds to the share.
constexpr double kFarthestBeyond = 0.2;

// After n sweeps over-relaxed by w what is stiffest has (1 - w)^n of its way left: it lies beyond its goal where n is
// odd. A single sweep is not to go beyond it at all.
double steady_relaxation(const SolverSettings& settings) {
    const int n = settings.iterations;
    if (n == 1) return std::min(settings.over_relaxation, 1.0);
    if (n % 2 == 0) return settings.over_relaxation;
    return std::min(settings.over_relaxation, 1 + math::pow(kFarthestBeyond, 1.0 / n));
}

}  // namespace

// Towards the implicit Euler step, contacts before it and after each sweep: what is hit is matched where the push has
// taken it, and not where it would fly to unhit.
void Substep::correct() {
    using Which = ContactRound::Which;
    take_up_bending(context, state, work);
    push_apart(Which::first);
    match_shapes(0);
    int most = context.settings.iterations;
    for (const int steps : work.loads.newton_steps) most = std::max(most, steps);
    for (int sweep = 1; sweep < most; ++sweep) {
        push_apart(Which::between, sweep);
        if (sweep >= context.settings.iterations) leave_out_what_is_matched(sweep);
        match_shapes(sweep);
    }
    push_apart(Which::last);
}

// All but the islands that take more Newton steps than that.
void Substep::leave_out_what_is_matched(int steps) {
    std::vector<uint8_t> goes_on(work.pieces.size(), 0);
    for (IslandId island(0); island < work.islands.size(); ++island)
        for (const PieceId piece : work.islands.pieces_of(island)) goes_on[piece] = newton_steps(island) > steps;
    for_all(n_particles(), [&](size_t i) { work.unmoved[i] |= !goes_on[work.piece[i]]; });
    for_pieces([&](size_t piece) { work.piece_unmoved[piece] |= !goes_on[piece]; });
}

// Where pins hold a piece that is stiff it is where its velocities take it that a Newton step starts from, and not
// where it would fall to: among those that are pinned the others would be far out of shape, and what ends the step is
// measured by what it begins with. A plank of 5 GPa at rest fell by a millimetre in each substep until it was felt, and
// sprang back.
void Substep::find_what_starts_unloaded() {
    work.starts_unloaded.resize(work.live.n_pieces());
    for_pieces([&](size_t piece) {
        const auto particles = work.live.piece_particles(piece);
        work.starts_unloaded[piece] = work.piece_held[piece] && !work.kept[particles.front()] &&
                                      !work.pair.smooth[particles.front()] && !resolves_waves(work, particles, h);
    });
}

bool Substep::starts_unloaded(size_t g) const { return work.starts_unloaded[work.live.piece(g)] && !work.held[g]; }

Vec3 Substep::fall_of(size_t g) const { return h * (work.velocity[g] - state.velocity[g]); }

void Substep::match_shapes(int sweep) {
    Stopwatch watch(report.shape_s);
    const SolverSettings& settings = context.settings;
    if (settings.method == Method::gauss_seidel) {
        std::vector<double> k;  // by body
        for (const Material& m : context.input.materials) k.push_back(m.stiffness);
        return gauss_seidel_sweep(rest(), work.live, work.shapes, k, work.unmoved, work.moving, work.goals);
    }

    const bool is_newton = settings.method == Method::projective;
    const bool starts = is_newton && sweep == 0;
    if (starts) find_what_starts_unloaded();
    for_all(n_particles(), [&](size_t g) {
        if (work.live.count(g) == 1) work.goals[g].rotation = work.moving[g].d;  // it matches itself wherever it is
        if (starts && starts_unloaded(g)) {
            work.moving[g].x -= fall_of(g);
            work.moving[g].x_inertial += work.brace[g] * fall_of(g);  // braces hold where it was
        }
    });
    const SweepInput in{rest(),      work.live, work.shapes, work.stiffness, work.unmoved,
                        work.span, work.brace, work.tether, bending()};
    if (is_newton) {
        work.newton.apply(sweep == 0, in, context.workers, work.goals, work.moving);
        if (starts)
            for_all(n_particles(), [&](size_t g) {
                if (starts_unloaded(g)) work.moving[g].x_inertial -= work.brace[g] * fall_of(g);
            });
    } else {
        work.jacobi.apply({sweep, settings.iterations, steady_relaxation(settings), work.is_touched}, in,
                          context.workers, work.goals, work.moving);
    }
    work.islands.for_each(context.workers, [&](IslandId island) {
        const bool stands = work.loads.how[island] == StandingLoads::How::together;
        if (stands && sweep < newton_steps(island)) pass_loads_on(context, island, work);
    });
    for_piece_ranges(work.live, kParticleGrain, context.workers, [&](size_t first, size_t last) {
        restore_linear_momentum(rest(), work.live, work.piece_unmoved, first, last, work.moving);
    });
}

void take_up_bending(const StepContext& context, const FrameState& state, Workspace& w) {
    if (w.thin.empty()) return;
    w.bending.update(context.scene.rest, w.live, w.shapes, w.stiffness,
                     {w.thin, w.pinned, state.plastic_deformation, state.plastic_curvature}, context.workers);
}

// Where numbers are not finite, nor is their sum.
bool Substep::is_sound(size_t i) const {
    const MovingParticle& p = work.moving[i];
    const double sum = p.x.sum() + p.d.coeffs().sum() + work.angular_velocity[i].sum();
    return std::isfinite(sum) && work.velocity[i].squaredNorm() < kRunawaySpeed * kRunawaySpeed;
}

Status Substep::check(const FirstOf& unsound, const char* stage) const {
    const size_t i = unsound.get();
    if (i >= n_movables()) return {};
    const MovingParticle& p = work.moving[i];
    const bool finite = p.x.allFinite() && p.d.coeffs().allFinite() && work.velocity[i].allFinite() &&
                        work.angular_velocity[i].allFinite();
    const std::string who =
        i < n_particles() ? "particle " + std::to_string(i) + " (body '" + context.scene.bodies[rest().body[i]].name +
                                "', fragment " + std::to_string(rest().fragment[i]) + ")"
                          : "rigid body '" + context.scene.rigid_bodies[i - n_particles()].name + "'";
    return Error{ErrorCode::numerical,
                 who + (finite ? " runs away (above 1e5 m/s)" : " is not finite") + " after " + stage,
                 "time " + std::to_string(state.time) + " s",
                 "use more substeps, or a smaller stiffness or force",
                 {},
                 {}};
}

namespace {

void fit_arrays(const FrameState& state, size_t n, size_t n_movables, Workspace& w) {
    w.synced_edges = state.edge_intact;
    w.moving.resize(n_movables), w.start_position.resize(n_movables), w.start_rotation.resize(n_movables);
    w.velocity.resize(n_movables), w.angular_velocity.resize(n_movables);
    w.inverse_mass.resize(n_movables), w.piece.resize(n_movables);
    w.push.resize(n_movables), w.brace.assign(n_movables, 0.0);
    w.inertia.resize(n), w.stiffness.resize(n), w.goals.resize(n);
    w.strains.assign(n, GroupStrain()), w.flowed.assign(n, 0), w.held.assign(n_movables, 0);
}

// Those of `former` whose rings hold the same particles as before.
std::vector<ParticleId> with_same_ring(std::span<const ParticleId> former, const LiveTopology& before,
                                     const LiveTopology& now, const WorkerPool& workers) {
    std::vector<ParticleId> known(former.begin(), former.end());
    const auto is_same = [&](size_t g) {
        if (now.count(g) != before.count(former[g])) return false;
        for (uint32_t k = 0; k < now.count(g); ++k)
            if (former[now.member(now.begin(g) + k)] != before.member(before.begin(former[g]) + k)) return false;
        return true;
    };
    workers.for_range(known.size(), kGroupGrain, [&](size_t first, size_t last) {
        for (size_t g = first; g < last; ++g)
            if (!former[g].is_none() && !is_same(g)) known[g] = ParticleId::none();
    });
    return known;
}

// What may be another in any frame: materials are animated, too.
void take_up_frame(const StepContext& context, const FrameState& state, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    const size_t n = rest.n_particles();
    w.pair.smooth.assign(n + context.scene.rigid_bodies.size(), 0);
    context.workers.for_range(n, kParticleGrain, [&](size_t first, size_t last) {
        for (size_t g = first; g < last; ++g) {
            const Material& material = context.input.materials[rest.body[g]];
            w.stiffness[g] = group_stiffness(w.shapes.group[g], w.shapes.rest_trace[g], rest.volume[g], material);
            w.goals[g].rotation = state.group_rotation[g];
        }
    });
    const bool is_projective = context.settings.method == Method::projective;
    w.thin.assign(is_projective && bends(rest, context.input.materials) ? n : 0, 0);
    for (size_t g = 0; g < w.thin.size(); ++g) w.thin[g] = bends(rest, context.input.materials, g);
}

bool is_in_line(const FrameState& state, size_t n_movables, const WorkerPool& workers, const Workspace& w) {
    const size_t n = state.n_particles();
    if (w.synced_edges != state.edge_intact || w.shapes.group.size() != n || w.moving.size() != n_movables)
        return false;
    std::atomic<bool> same{true};
    workers.for_range(n, kGroupGrain, [&](size_t first, size_t last) {
        for (size_t g = first; g < last; ++g)
            if (w.shapes.group[g].plastic_key != plastic_key(state.plastic_deformation[g])) same = false;
    });
    return same;
}

}  // namespace

void renumber(const StepContext& context, const FrameState& state, std::span<const ParticleId> former, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    const size_t n = rest.n_particles();
    SUNDER_ASSERT(former.size() == n && state.n_particles() == n && state.edge_intact.size() == rest.n_edges());
    const LiveTopology before = w.live;
    w.live.reset(rest, state.edge_intact, context.workers);
    const std::vector<ParticleId> known = with_same_ring(former, before, w.live, context.workers);
    w.detection.renumber(known);
    w.shapes.renumber(rest, w.live, state.plastic_deformation, {known, before}, context.workers);
    fit_arrays(state, n, n + context.scene.rigid_bodies.size(), w);
    take_up_frame(context, state, w);
}

void synchronise(const StepContext& context, const FrameState& state, Workspace& w) {
    const SimulationMesh& rest = context.scene.rest;
    const size_t n = rest.n_particles(), n_movables = n + context.scene.rigid_bodies.size();
    SUNDER_ASSERT(state.n_particles() == n && state.edge_intact.size() == rest.n_edges());
    SUNDER_ASSERT(state.rigid_bodies.size() == context.scene.rigid_bodies.size());
    if (!is_in_line(state, n_movables, context.workers, w)) {
        w.live.reset(rest, state.edge_intact, context.workers);
        w.detection.reset();
        w.shapes.reset(rest, w.live, state.plastic_deformation);
        fit_arrays(state, n, n_movables, w);
    }
    take_up_frame(context, state, w);
    invariant("rings match edges", [&] { return rings_match_edges(w.live, rest, state.edge_intact); });
}

Status substep(const StepContext& context, const SubstepTime& time, Workspace& io_work, FrameState& io_state,
               StepReport& io_report) {
    const double h = time.h;
    SUNDER_ASSERT(h > 0 && time.begin >= 0 && time.begin < time.end && time.end <= 1);
    Substep s{context, time.stage, h, time.begin, time.end, time.measure, io_work, io_state, io_report};
    SUNDER_ASSERT(io_state.n_particles() == s.n_particles() && io_work.moving.size() == s.n_movables());
    SUNDER_ASSERT(context.fixed.empty() || context.fixed.size() == s.n_movables());
    SUNDER_ASSERT(context.input.materials.size() == context.scene.bodies.size());
    io_work.kept.assign(s.n_movables(), 0), io_work.is_taken_again = false, io_work.parts = 1;
    bool has_flowed = false, may_break = false;  // what a contact pushes, at the end
    for (int pass = 1;; ++pass) {
        do {
            {
                Stopwatch watch(io_report.predict_s);
                s.load();
                s.hold();
            }
            {
                Stopwatch watch(io_report.contact_s);
                s.find_contacts();
            }
            if (!io_work.woken.empty()) return {};
            if (pass == 1 && s.find_hits()) return {};
        } while (io_work.is_taken_again && s.let_go_of_mixed_islands());
        io_report.simulated += static_cast<size_t>(std::ranges::count(io_work.kept, 0));
        s.pair_up();
        s.correct();
        tumble_pieces(context, h, io_work);
        has_flowed |= s.run_cracks(has_flowed);
        may_break = s.contacts_push();
        if (!may_break || pass == context.settings.crack_passes) break;
        may_break = s.break_in_hit(has_flowed ? 0 : h);
        has_flowed = true;
        if (!may_break) break;
    }
    {
        Stopwatch watch(io_report.momentum_s);
        turn_rigid_things(context, h, io_work);
        if (Status ok = s.take_up_motion(); !ok) return ok;
        s.damp_vibrations();
        s.restore_momentum();
    }
    {
        Stopwatch watch(io_report.contact_s);
        s.settle_contacts();
    }
    if (may_break) {
        Stopwatch watch(io_report.fracture_s);
        s.break_edges(s.flow_and_measure(has_flowed ? 0 : h), 0);
    }
    if (Status ok = s.store(); !ok) return ok;
    io_report.n_components = io_work.live.n_pieces();
    return {};
}

}  // namespace sunder
