#include "solver/frame/error_budget.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "solver/matching/polar_decomposition.h"
#include "solver/material/fracture.h"
#include "solver/scene/motion.h"
#include "solver/scene/scales.h"
#include "solver/step/letting_go.h"

namespace sunder {
namespace {

// Phase error of a single mode is (omega h)^2 / 3, or less in a pair of substeps that touches nothing. What is seen
// moving has higher modes beside the one that the quotient finds: a released twist has its half period off by this much
// more (the chart's release_period).
constexpr double kPhaseError = 1.0 / 3;
constexpr double kHigherModes = 2.0;
constexpr double kUnseenStrain = 0.01;  // strains below it move little; their phase matters in proportion
// One Newton step of a whole frame leaves stiff bodies rough, and their quotient large.
constexpr int kTrialIterations = 2;
constexpr double kFramesToBreaking = 4;  // at the present rate; from there on strains are followed closely
constexpr double kBreakingMargin = 2;    // waves that meet at the tear are smeared on their way (the chart's tear_time)
constexpr double kLargestTurn = 0.1;     // rad a substep that one Newton step follows well
constexpr size_t kGrain = 128;           // fewest groups a thread is worth waking for

// The particles of a state, or where they would be.
using Placement = std::vector<MovingParticle>;

// What active pins and activations hold.
struct Held {
    std::vector<uint8_t> particle, piece;

    Held(const StepContext& context, const FrameState& state, const LiveTopology& live)
        : particle(context.scene.rest.n_particles(), 0), piece(live.n_pieces(), 0) {
        for (size_t k = 0; k < context.scene.pins.size(); ++k)
            if (context.input.pins[k].active)
                for (const ParticleId j : context.scene.pins[k].particles) particle[j] = piece[live.piece(j)] = 1;
        for (size_t j = 0; j < state.inactive.size(); ++j)
            if (is_kept(state, j)) particle[j] = piece[live.piece(j)] = 1;
    }
};

Placement placement_of(const SimulationMesh& rest, const FrameState& state) {
    Placement p(rest.n_particles());
    for (size_t i = 0; i < p.size(); ++i) {
        p[i].x = state.position[i];
        p[i].d = (state.orientation[i] * rest.rest_orientation[i].conjugate()).normalized();
    }
    return p;
}

struct RigidMotion {
    Vec3 center = Vec3::Zero(), velocity = Vec3::Zero(), spin = Vec3::Zero();
};

// The rigid motion with the linear and angular momentum of a piece whose particles move at `velocity`.
RigidMotion rigid_motion(const SimulationMesh& rest, std::span<const ParticleId> particles, const Placement& at,
                         std::span<const Vec3> velocity) {
    RigidMotion m;
    double mass = 0;
    for (const ParticleId j : particles) {
        mass += rest.mass[j];
        m.center += rest.mass[j] * (at[j].x - at[particles.front()].x);
        m.velocity += rest.mass[j] * velocity[j];
    }
    m.center = at[particles.front()].x + m.center / mass;
    m.velocity /= mass;
    Vec3 L = Vec3::Zero();
    Mat3 H = Mat3::Zero();
    for (const ParticleId j : particles) {
        const Vec3 r = at[j].x - m.center;
        const double own = 0.4 * rest.radii[j].squaredNorm() / 3;  // of a ball: keeps H regular
        L += rest.mass[j] * r.cross(velocity[j] - m.velocity);
        H += rest.mass[j] * ((r.squaredNorm() + own) * Mat3::Identity() - r * r.transpose());
    }
    m.spin = H.inverse() * L;
    return m;
}

enum class Path { rigid, inertial };

// Where the particles would be at the end of the frame if every free piece moved as a whole (rigid), or if nothing but
// gravity, forces and their own motion moved them about their turning piece (inertial): a tumbling fragment strains in
// neither.
// Held particles are where the trial took them.
Placement moved(Path path, const StepContext& context, const FrameState& state, const LiveTopology& live,
                const Held& held, const Placement& start, const Placement& end) {
    const SimulationMesh& rest = context.scene.rest;
    const double seconds = context.input.duration, own_seconds = path == Path::inertial ? seconds : 0;
    const Vec3 drop = 0.5 * seconds * seconds * FieldsOfForce(context.input).acceleration;
    Placement p = end;
    for (size_t piece = 0; piece < live.n_pieces(); ++piece) {
        const auto particles = live.piece_particles(piece);
        const bool free = !held.piece[piece];
        const RigidMotion m = free ? rigid_motion(rest, particles, start, state.velocity) : RigidMotion();
        const Quat turn = rotation_of(seconds * m.spin);
        for (const ParticleId j : particles) {
            if (held.particle[j] && path == Path::inertial) continue;
            const Vec3 r = start[j].x - m.center;
            const Vec3 own = state.velocity[j] - m.velocity - m.spin.cross(r);
            p[j].x = m.center + seconds * m.velocity + turn * (r + own_seconds * own);
            if (free || path == Path::inertial) p[j].x += drop;
            p[j].d = (turn * rotation_of(own_seconds * (state.angular_velocity[j] - m.spin)) * start[j].d).normalized();
        }
    }
    return p;
}

// How much the members of a group move against their goal from one placement to another, as the group turns:
// sum m |R_b^T r_b - R_a^T r_a|^2, r = x - goal, kg m2. Over the positions' part of A_qq it is a strain squared.
double misfit(const LiveModel& model, std::span<const GroupGoal> goals, uint32_t g, const Placement& a,
              const Placement& b) {
    Mat3 back[2];
    Vec3 center[2];
    const Placement* placements[2] = {&a, &b};
    for (int k = 0; k < 2; ++k) {
        const GroupMoments A = group_moments(model.live, model.shapes, *placements[k], g);
        const Mat3 isotropy = to_matrix(model.shapes.group[g].isotropy);
        const Mat3 A_pq = A.positions * isotropy + kOrientationWeight * A.ellipsoids;
        back[k] = optimal_rotation(A_pq, goals[g].rotation).toRotationMatrix().transpose();
        center[k] = A.center;
    }
    double sum = 0;
    for (uint32_t s = model.live.begin(g); s < model.live.end(g); ++s) {
        const uint32_t j = model.live.member(s);
        sum += model.shapes.member_mass(model.live, s) *
               (back[1] * (b[j].x - center[1]) - back[0] * (a[j].x - center[0])).squaredNorm();
    }
    return sum;
}

// How far a group deforms from one placement to another.
struct Deformation {
    double energy = 0;  // twice what it takes, over k, kg m2
    double strain = 0;  // -
};

// Of a thin group by its stretch and its bending; the strain is that at its faces.
Deformation bent(const LiveModel& model, uint32_t g, const Placement& a, const Placement& b) {
    const BendingShape& shape = model.bending.shape(g);
    std::vector<BentMember> members(model.live.count(g));
    const BentGroup from = bend(model.bending, model.live, a, g, members);
    const BentGroup to = bend(model.bending, model.live, b, g, members);
    const Mat3 stretch = to.R.transpose() * to.F - from.R.transpose() * from.F, curvature = to.K - from.K;
    const Eigen::Map<const Vec9> K(curvature.data());
    const double energy = 2 * shape.mu * shape.volume * stretch.squaredNorm() + K.dot(shape.bending * K);
    return {energy / shape.k, stretch.norm() + shape.extent.minCoeff() / 2 * curvature.norm()};
}

Deformation deformation(const LiveModel& model, std::span<const GroupGoal> goals, uint32_t g, const Placement& a,
                        const Placement& b) {
    if (model.is_thin(g)) return model.bends(g) ? bent(model, g, a, b) : Deformation();
    const double sum = misfit(model, goals, g, a, b);
    return {sum, std::sqrt(sum / model.shapes.group[g].positions_trace)};
}

struct GroupChange {
    double misfit = 0;  // from start to end, kg m2
    double strain = 0;  // the same as a strain, -
    double pushed = 0;  // strain from the inertial path to the end, -
};

std::vector<GroupChange> group_changes(const StepContext& context, const LiveModel& model,
                                       std::span<const GroupGoal> goals, const Placement& start, const Placement& path,
                                       const Placement& end) {
    std::vector<GroupChange> changes(start.size());
    context.workers.for_range(changes.size(), kGrain, [&](size_t first, size_t last) {
        for (uint32_t g = static_cast<uint32_t>(first); g < last; ++g) {
            if (model.live.count(g) == 1) continue;
            const Deformation whole = deformation(model, goals, g, start, end);
            changes[g] = {whole.energy, whole.strain, deformation(model, goals, g, path, end).strain};
        }
    });
    return changes;
}

// Substeps that the phase of one piece's oscillation asks for; `shift`: from the rigid path to the end, m.
double oscillation(const StepContext& context, const LiveModel& model, bool touches,
                   std::span<const ParticleId> particles, bool held, const Placement& end, std::span<const Vec3> shift,
                   const std::vector<GroupChange>& changes) {
    const SimulationMesh& rest = context.scene.rest;
    double elastic = 0, inertia = 0, strain = 0;
    for (const ParticleId g : particles) {
        elastic += model.stiffness[g].k * changes[g].misfit;
        strain = std::max(strain, changes[g].pushed);
    }
    const RigidMotion m = held ? RigidMotion() : rigid_motion(rest, particles, end, shift);
    for (const ParticleId j : particles)
        inertia += rest.mass[j] * (shift[j] - m.velocity - m.spin.cross(end[j].x - m.center)).squaredNorm();
    if (!(inertia > 0)) return 1;
    const double omega_squared = elastic / inertia, seen = std::min(1.0, strain / kUnseenStrain);
    const double seconds = context.input.duration;
    const double damping_time = context.material(particles.front()).damping_time;
    double substeps = 1, error = kPhaseError;
    for (int pass = 0; pass < 3; ++pass) {  // the error of pairs depends on the substep
        const bool pairs = !touches && substeps > 1 && context.settings.method != Method::gauss_seidel &&
                           resolves_waves(model, particles, seconds / substeps);
        error = pairs ? phase_error(damping_time, seconds / substeps) : kPhaseError;
        substeps = seconds * std::sqrt(error * kHigherModes * omega_squared * seen / context.settings.error_budget);
        substeps = std::clamp(substeps, 1.0, double(kMostBudgetSubsteps));
    }
    return substeps;
}

// Substeps that the time of breaking asks for in one piece.
double breaking(const StepContext& context, const LiveTopology& live, const FrameState& state,
                std::span<const ParticleId> particles, const std::vector<GroupChange>& changes) {
    double most = 1;
    for (const ParticleId g : particles) {
        const double toughness = breaking_strain(context, state, live, g);
        if (toughness < kNever && state.strain[g] + kFramesToBreaking * changes[g].strain > toughness)
            most = std::max(most, kBreakingMargin * changes[g].strain / (context.settings.error_budget * toughness));
    }
    return most;
}

// Whether a piece neither deforms nor is being stopped: `after` is the state at the end of the trial, `soon` that after
// a first short substep.
bool calm(const StepContext& context, const LiveModel& model, std::span<const ParticleId> particles,
          const Placement& start, const FrameState& state, const FrameState& soon, const FrameState& after) {
    const SimulationMesh& rest = context.scene.rest;
    const double seconds = context.input.duration;
    auto size = [&](uint32_t g) {
        return std::sqrt(model.shapes.group[g].positions_trace / model.shapes.group[g].mass);
    };
    for (const FrameState* s : {&state, &soon}) {
        const RigidMotion m = rigid_motion(rest, particles, start, s->velocity);
        for (const ParticleId j : particles) {
            const Vec3 own = s->velocity[j] - m.velocity - m.spin.cross(start[j].x - m.center);
            if (own.norm() * seconds > kCalm * size(j)) return false;
        }
    }
    const Vec3 stopped = rigid_motion(rest, particles, start, after.velocity).velocity -
                         rigid_motion(rest, particles, start, state.velocity).velocity;
    return stopped.norm() <= calm_speed(context.input, size(particles.front()));
}

double largest_turn(const Placement& start, const Placement& end) {
    double turn = 0;
    for (size_t j = 0; j < start.size(); ++j)
        turn = std::max(turn, rotation_vector(end[j].d * start[j].d.conjugate()).norm());
    return turn;
}

}  // namespace

FramePlan plan_frame(const StepContext& context, const FrameState& state, StepMemory& io_memory) {
    SolverSettings once = context.settings;
    once.substeps = 1, once.iterations = kTrialIterations, once.crack_passes = once.hit_substeps = 1;
    const StepContext trial{context.scene,          context.input, once, context.workers,
                            context.contact_margin, context.fixed, false};
    const double seconds = context.input.duration;
    FramePlan plan;
    FrameState after = state, soon = state;
    bool sound = bool(step(trial, {Stage::alone, seconds, 0, 1, true}, io_memory, after, plan.report));
    io_memory.synchronise(context, state);
    const bool touches = plan.report.contacts > 0;
    if (sound && touches) {
        StepReport unused;
        sound = bool(step(trial, {Stage::alone, seconds / kContactSubsteps, 0, 1.0 / kContactSubsteps, false},
                          io_memory, soon, unused));
        io_memory.synchronise(context, state);
    }
    if (!sound) {
        plan.substeps = kMostBudgetSubsteps, plan.iterations = kTrialIterations;
        return plan;
    }

    io_memory.model.take_up_bending(context.scene.rest, state, context.workers);
    const LiveModel& model = io_memory.model;
    const Placement start = placement_of(context.scene.rest, state), end = placement_of(context.scene.rest, after);
    const Held held(context, state, model.live);
    const Placement path = moved(Path::inertial, context, state, model.live, held, start, end);
    const Placement rigid = moved(Path::rigid, context, state, model.live, held, start, end);
    std::vector<Vec3> shift(start.size());
    for (size_t j = 0; j < shift.size(); ++j) shift[j] = end[j].x - rigid[j].x;
    const std::vector<GroupChange> changes = group_changes(context, model, io_memory.matching.goals, start, path, end);
    double substeps = touches ? kContactSubsteps : 1;
    for (size_t piece = 0; piece < model.live.n_pieces(); ++piece) {
        const auto particles = model.live.piece_particles(piece);
        if (particles.size() == 1) continue;
        if (touches && calm(context, model, particles, start, state, soon, after)) continue;
        substeps = std::max({substeps, breaking(context, model.live, state, particles, changes),
                             oscillation(context, model, touches, particles, held.piece[piece], end, shift, changes)});
    }
    plan.substeps = static_cast<int>(std::ceil(std::min(substeps, double(kMostBudgetSubsteps)) - 1e-6));
    if (plan.substeps > 1) plan.substeps += plan.substeps % 2;  // pairs are of second order
    const bool turns = largest_turn(start, end) > kLargestTurn * plan.substeps;
    plan.iterations = touches || turns ? 2 : 1;
    if (plan.substeps == 1) {
        plan.iterations = kTrialIterations;
        // The trial takes no parts, in which cracks run.
        const bool is_whole = after.edge_damage.empty() || after.broken.size() == state.broken.size();
        if (is_whole) plan.done = std::move(after);
    }
    plan.report.substeps = plan.substeps, plan.report.iterations = plan.iterations;
    return plan;
}

}  // namespace sunder
