#include "solver/matching/thin_groups.h"
#include "solver/solver.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "solver/awake_scene.h"
#include "solver/error_budget.h"
#include "solver/local_hit.h"
#include "solver/matching/unit_schedule.h"
#include "solver/material/plasticity.h"
#include "solver/scene/scene_fields.h"
#include "solver/sleeping.h"
#include "solver/threads/first_of.h"
#include "solver/threads/thread_trial.h"

namespace sunder {
namespace {

constexpr double kLongestFrame = 1000;  // s

std::string number(double v) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", v);
    return text;
}

// Of the first of n particles that is not sound.
template <class IsSound>
Status all_sound(size_t n, const char* array, const char* fault, const WorkerPool& workers, const IsSound& is_sound) {
    FirstOf unsound;
    workers.for_range(n, kParticleGrain, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i)
            if (!is_sound(i)) return unsound.add(i);
    });
    if (unsound.get() >= n) return {};
    return bad_input("state", std::string(array) + " of particle " + std::to_string(unsound.get()) + fault);
}

Status all_finite(const char* array, const std::vector<Vec3>& values, const WorkerPool& workers) {
    return all_sound(values.size(), array, " is not finite", workers,
                     [&](size_t i) { return std::isfinite(values[i].sum()) || values[i].allFinite(); });
}

Status all_unit(const char* array, const std::vector<Quat>& values, const WorkerPool& workers) {
    return all_sound(values.size(), array, " is not a unit quaternion", workers,
                     [&](size_t i) { return std::abs(values[i].norm() - 1) < 1e-3; });
}

Status check_scene(const Scene& scene) {
    const SimulationMesh& rest = scene.rest;
    const size_t n = rest.n_particles();
    if (n == 0 && scene.rigid_bodies.empty())
        return bad_input("scene", "nothing to simulate", "add a body or a rigid body");
    for (size_t i = 0; i < n; ++i) {
        const bool sound = rest.rest_position[i].allFinite() && rest.mass[i] > 0 && std::isfinite(rest.mass[i]) &&
                           rest.volume[i] > 0 && rest.radii[i].minCoeff() > 0 && rest.radii[i].allFinite() &&
                           std::abs(rest.rest_orientation[i].norm() - 1) < 1e-6;
        if (!sound)
            return bad_input(
                "scene",
                "particle " + std::to_string(i) +
                    " has a rest position, mass, volume, radius or orientation that is not finite and positive");
        if (rest.body[i] >= scene.bodies.size())
            return bad_input("scene", "particle " + std::to_string(i) + " belongs to body " +
                                          std::to_string(rest.body[i]) + " of " + std::to_string(scene.bodies.size()));
    }
    for (const std::vector<double>* factors : {&rest.yield_factor, &rest.toughness_factor}) {
        const bool sound = std::all_of(factors->begin(), factors->end(), [](double f) { return f > 0; });
        if (!sound || (!factors->empty() && factors->size() != n))
            return bad_input("scene", "yield or toughness factors are not one above 0 for each particle");
    }
    for (size_t e = 0; e < rest.n_edges(); ++e)
        if (!(rest.edges[e].toughness_factor > 0))
            return bad_input("scene", "edge " + std::to_string(e) + " has a toughness factor that is not above 0");
    for (const Pin& pin : scene.pins)
        for (const ParticleId i : pin.particles)
            if (i >= n)
                return bad_input("pin '" + pin.name + "'",
                                 "holds particle " + std::to_string(i) + " of " + std::to_string(n));
    for (const Collider& collider : scene.colliders) {
        const std::string where = "collider '" + collider.name + "'";
        const SignedDistanceGrid* grid = collider.shape.grid;
        if (collider.shape.kind != ShapeKind::mesh) continue;
        if (!grid || grid != collider.grid.get())
            return bad_input(where, "is a mesh without a distance grid of its own");
        const size_t n_nodes = size_t(grid->nodes[0]) * grid->nodes[1] * grid->nodes[2];
        if (std::ranges::min(grid->nodes) < 2 || grid->distance.size() != n_nodes || !(grid->voxel_size > 0))
            return bad_input(where, "has a distance grid of fewer values than nodes, or none");
    }
    for (const RigidBody& body : scene.rigid_bodies) {
        const std::string where = "rigid body '" + body.name + "'";
        if (body.shape.kind != ShapeKind::sphere && body.shape.kind != ShapeKind::box)
            return bad_input(where, "is neither a sphere nor a box");
        if (!(body.mass > 0 && std::isfinite(body.mass)))
            return bad_input(where, "mass is " + number(body.mass), "give a mass above 0 kg");
        if (!(body.shape.radius > 0 && body.shape.half_extents.minCoeff() > 0))
            return bad_input(where, "size is not positive");
    }
    return {};
}

}  // namespace

Status Material::check(const std::string& where) const { return check_fields(material_fields(), *this, where); }

Status SolverSettings::check(const std::string& where) const { return check_fields(settings_fields(), *this, where); }

struct Solver::Impl {
    struct Hit {
        int parts = 1;              // of the substep, that it asks for
        std::vector<uint8_t> what;  // takes them (n_movables)
    };

    Scene scene;
    std::shared_ptr<const WorkerPool> workers;
    WorkerPool alone{1};
    std::optional<ThreadTrial> trial;   // of frames on the calling thread alone
    double margin;                      // of contacts, m
    Workspace work;                     // of the whole scene
    AwakeScene awake;                   // what is simulated while something sleeps
    std::optional<LocalHit> local_hit;  // from the first of a frame until a frame had none
    bool has_local_hits = false;        // this frame
    bool met = false;                   // in it what was hit met the rest: it may again

    Impl(Scene s, std::shared_ptr<const WorkerPool> w)
        : scene(std::move(s)), workers(std::move(w)), margin(contact_margin(scene)) {}
    Status check_input(const FrameInput& input) const;
    void forget() { work = {}, awake = {}, local_hit.reset(); }
    void enter(const StepContext& whole, const FrameState& state);
    SubstepPair pair(const WorkerPool& threads, const FrameState& state);
    void go_on(const StepContext& whole, const FrameState& state, SubstepPair pair);
    Status advance(const StepContext& whole, const SubstepTime& time, FrameState& io_state, StepReport& io_report,
                   Hit& o_hit);
    Result<bool> advance_local_hit(const StepContext& whole, const Hit& hit, const SubstepTime& time,
                                   const Progress& progress, FrameState& io_state, StepReport& io_report);
    Status advance_hit(const StepContext& whole, const Hit& hit, const SubstepTime& time, const Progress& progress,
                       FrameState& io_state, StepReport& io_report, bool& o_pair_begun);
    Result<StepReport> run_frame(const FrameInput& input, const SolverSettings& settings, const FrameState& before,
                                 const WorkerPool& threads, FrameState& io_state, const Progress& progress);
};

Solver::Solver() = default;
Solver::~Solver() = default;
const Scene& Solver::scene() const { return impl_->scene; }

Result<std::unique_ptr<Solver>> Solver::create(Scene scene, int threads) {
    auto solver = create(std::move(scene), std::make_shared<const WorkerPool>(threads));
    if (solver) (*solver)->impl_->trial.reset();  // so many were asked for
    return solver;
}

Result<std::unique_ptr<Solver>> Solver::create(Scene scene, std::shared_ptr<const WorkerPool> workers) {
    if (Status ok = check_scene(scene); !ok) return ok.error();
    trim(scene.rest);
    build_one_rings(scene.rest);
    scene.rest.group_trace = rest_traces(scene.rest);
    scene.rest.thin = thin_groups(scene.rest);
    std::unique_ptr<Solver> solver(new Solver());
    solver->impl_ = std::make_unique<Impl>(std::move(scene), std::move(workers));
    if (solver->impl_->workers->threads() > 1) solver->impl_->trial.emplace();
    return solver;
}

FrameState Solver::initial_state(const std::vector<Material>& materials) const {
    const Scene& scene = impl_->scene;
    const SimulationMesh& rest = scene.rest;
    const size_t n = rest.n_particles();
    FrameState s;
    s.position = rest.rest_position;
    s.orientation = rest.rest_orientation;
    s.velocity.assign(n, Vec3::Zero());
    s.angular_velocity.assign(n, Vec3::Zero());
    s.plastic_deformation.assign(n, Mat3::Identity());
    s.yield.resize(n);
    s.strain.assign(n, 0.0);
    s.group_rotation.assign(n, Quat::Identity());
    s.edge_intact.assign(rest.n_edges(), 1);
    for (const Body& body : scene.bodies) {
        Vec3 center = Vec3::Zero();
        double mass = 0;
        for (uint32_t i = body.particle_begin; i < body.particle_end; ++i)
            mass += rest.mass[i], center += rest.mass[i] * rest.rest_position[i];
        if (mass > 0) center /= mass;
        for (uint32_t i = body.particle_begin; i < body.particle_end; ++i) {
            s.velocity[i] = body.velocity + body.angular_velocity.cross(rest.rest_position[i] - center);
            s.angular_velocity[i] = body.angular_velocity;
            s.yield[i] = yield_strain(rest, i, materials[rest.body[i]]);
        }
    }
    add_bending(rest, materials, s);
    s.still_time.assign(n + scene.rigid_bodies.size(), 0.0);
    s.asleep.assign(s.still_time.size(), 0);
    s.rest_load.assign(s.still_time.size(), 0.0);
    for (const RigidBody& body : scene.rigid_bodies)
        s.rigid_bodies.push_back({body.pose.position, body.pose.orientation, body.velocity, body.angular_velocity});
    return s;
}

Status Solver::Impl::check_input(const FrameInput& input) const {
    if (!(input.duration > 0 && input.duration <= kLongestFrame))
        return bad_input("frame", "duration is " + number(input.duration) + " s",
                         "permitted: above 0, at most " + number(kLongestFrame));
    if (!input.gravity.allFinite()) return bad_input("frame", "gravity is not finite");
    if (input.materials.size() != scene.bodies.size() || input.pins.size() != scene.pins.size() ||
        input.colliders.size() != scene.colliders.size())
        return Error{
            ErrorCode::internal, "frame input does not match the scene's bodies, pins and colliders", {}, {}, {}, {}};
    for (size_t b = 0; b < scene.bodies.size(); ++b)
        if (Status ok = input.materials[b].check("body '" + scene.bodies[b].name + "'"); !ok) return ok;
    for (const std::vector<DrivenPose>* driven : {&input.pins, &input.colliders})
        for (const DrivenPose& d : *driven)
            if (!(d.begin.position.allFinite() && d.end.position.allFinite() &&
                  d.begin.orientation.coeffs().allFinite() && d.end.orientation.coeffs().allFinite()))
                return bad_input("frame", "a pin's or collider's pose is not finite");
    for (const DrivenPose& d : input.pins)
        if (!(std::min(d.grip.begin, d.grip.end) >= 0 && std::max(d.grip.begin, d.grip.end) <= 1 && d.grip.time >= 0))
            return bad_input("frame", "a pin's grip is not one", "permitted: 0 to 1, over 0 s or more");
    return {};
}

Status Solver::check_state(const FrameState& s) const {
    const size_t n = impl_->scene.rest.n_particles();
    if (s.position.size() != n || s.orientation.size() != n || s.velocity.size() != n ||
        s.angular_velocity.size() != n || s.plastic_deformation.size() != n || s.yield.size() != n ||
        s.strain.size() != n || s.group_rotation.size() != n)
        return bad_input("state",
                         "holds " + std::to_string(s.position.size()) + " particles, the scene " + std::to_string(n));
    if (s.edge_intact.size() != impl_->scene.rest.n_edges())
        return bad_input("state", "holds " + std::to_string(s.edge_intact.size()) + " edges, the scene " +
                                      std::to_string(impl_->scene.rest.n_edges()));
    if (s.rigid_bodies.size() != impl_->scene.rigid_bodies.size())
        return bad_input("state", "holds " + std::to_string(s.rigid_bodies.size()) + " rigid bodies, the scene " +
                                      std::to_string(impl_->scene.rigid_bodies.size()));
    const size_t n_movables = n + s.rigid_bodies.size();
    if (s.asleep.size() != s.still_time.size() || s.asleep.size() != s.rest_load.size() ||
        (!s.asleep.empty() && s.asleep.size() != n_movables))
        return bad_input("state", "says of " + std::to_string(s.asleep.size()) +
                                      " particles and rigid bodies whether "
                                      "they sleep, the scene has " +
                                      std::to_string(n_movables));
    for (const ContactMemory& c : s.contacts)
        if (c.a >= n_movables ||
            (c.b & Contact::kStatic ? (c.b & ~Contact::kStatic) >= impl_->scene.colliders.size() : c.b >= n_movables))
            return bad_input("state", "has a contact of what is not in the scene");
    if (s.plastic_curvature.size() != s.layer_strain.size() ||
        (!s.plastic_curvature.empty() && s.plastic_curvature.size() != n))
        return bad_input("state", "has plastic curvatures of " + std::to_string(s.plastic_curvature.size()) +
                                      " particles, the scene has " + std::to_string(n));
    const WorkerPool& workers = *impl_->workers;
    if (Status ok = all_finite("position", s.position, workers); !ok) return ok;
    if (Status ok = all_finite("velocity", s.velocity, workers); !ok) return ok;
    if (Status ok = all_finite("angular velocity", s.angular_velocity, workers); !ok) return ok;
    if (Status ok = all_unit("orientation", s.orientation, workers); !ok) return ok;
    if (Status ok = all_unit("group rotation", s.group_rotation, workers); !ok) return ok;
    return all_sound(n, "plastic deformation or yield", " is not possible", workers, [&](size_t i) {
        return s.plastic_deformation[i].allFinite() && s.plastic_deformation[i].determinant() > 0.5 && s.yield[i] > 0;
    });
}

void Solver::Impl::enter(const StepContext& whole, const FrameState& state) {
    if (anything_sleeps(state)) return awake.enter(whole, state);
    awake.forget();
    synchronise(whole, state, work);
}

// Of all that is awake. Empties where it is kept.
SubstepPair Solver::Impl::pair(const WorkerPool& threads, const FrameState& state) {
    return anything_sleeps(state) ? awake.pair(threads) : std::move(work.pair);
}

// After `enter`, between two substeps of a pair.
void Solver::Impl::go_on(const StepContext& whole, const FrameState& state, SubstepPair pair) {
    if (anything_sleeps(state))
        awake.go_on(pair, whole.workers);
    else
        work.pair = std::move(pair);
}

// A substep of all that is awake, anew as long as it wakes something. Where `o_hit` asks for parts the state is as
// before.
Status Solver::Impl::advance(const StepContext& whole, const SubstepTime& time, FrameState& io_state,
                             StepReport& io_report, Hit& o_hit) {
    o_hit = {};
    while (anything_sleeps(io_state)) {
        if (awake.empty()) {
            awake.state().time += time.h;
            return {};
        }
        awake.cover(whole, time.h, time.end, io_state);
        const Status ok = substep(awake.context(whole), time, awake.work(), awake.state(), io_report);
        if (awake.work().parts > 1) o_hit = {awake.work().parts, awake.hit()};
        if (!ok || awake.work().woken.empty()) return ok;
        awake.leave(whole.workers, io_state);
        wake(scene, whole.input, awake.woken(), io_state);
        SubstepPair begun = awake.pair(whole.workers);
        enter(whole, io_state);
        go_on(whole, io_state, std::move(begun));
    }
    const Status ok = substep(whole, time, work, io_state, io_report);
    if (work.parts > 1) o_hit = {work.parts, work.hit};
    return ok;
}

// False where all is to take the parts of the hit.
Result<bool> Solver::Impl::advance_local_hit(const StepContext& whole, const Hit& hit, const SubstepTime& time,
                                             const Progress& progress, FrameState& io_state, StepReport& io_report) {
    if (met || !LocalHit::pays(hit.what, hit.parts, io_state)) return false;
    if (anything_sleeps(io_state)) awake.leave(whole.workers, io_state);
    SubstepPair begun = pair(whole.workers, io_state);
    if (!local_hit) local_hit.emplace();
    has_local_hits = true;
    const Result<bool> done =
        local_hit->advance(whole, hit.what, hit.parts, time, progress, io_state, begun, io_report);
    if (!done) return done;
    met = !*done;
    enter(whole, io_state);
    go_on(whole, io_state, std::move(begun));
    if (!anything_sleeps(io_state)) io_report.n_components = work.live.n_pieces();
    return done;
}

// A substep in which something is hit, in parts.
Status Solver::Impl::advance_hit(const StepContext& whole, const Hit& hit, const SubstepTime& time,
                                 const Progress& progress, FrameState& io_state, StepReport& io_report,
                                 bool& o_pair_begun) {
    io_report.substeps += hit.parts - 1;
    const Result<bool> local = advance_local_hit(whole, hit, time, progress, io_state, io_report);
    if (!local) return local.error();
    o_pair_begun = *local && time.stage == Stage::first;
    if (*local) return {};
    const SolverSettings settings = settings_of_parts(whole.settings);
    const StepContext context{whole.scene, whole.input, settings, whole.workers, whole.contact_margin};
    return in_parts(hit.parts, time, progress, [&](const SubstepTime& part) {
        Hit none;
        return advance(context, part, io_state, io_report, none);
    });
}

// Spoils the state on an error; `before` is what it was.
Result<StepReport> Solver::Impl::run_frame(const FrameInput& input, const SolverSettings& settings,
                                           const FrameState& before, const WorkerPool& threads, FrameState& io_state,
                                           const Progress& progress) {
    SolverSettings effort = settings;
    const StepContext context{scene, input, effort, threads, margin};
    if (settings.sleeping && !io_state.asleep.empty())
        wake_changed(scene, input, settings.self_collision, margin, io_state);
    else
        forget_sleep(settings.sleeping ? scene.rest.n_particles() + scene.rigid_bodies.size() : 0, io_state);
    StepReport report;
    enter(context, io_state);
    if (!std::exchange(has_local_hits, false)) local_hit.reset();
    met = false;
    bool done = false;
    if (settings.error_budget > 0 && !(anything_sleeps(io_state) && awake.empty())) {
        if (!progress.report(0, "simulating")) return cancelled();
        const bool reduced = anything_sleeps(io_state);
        FrameState& state = reduced ? awake.state() : io_state;
        if (reduced) awake.cover(context, input.duration, 1, io_state);
        FramePlan plan =
            reduced ? plan_frame(awake.context(context), state, awake.work()) : plan_frame(context, state, work);
        effort.substeps = plan.substeps, effort.iterations = plan.iterations;
        done = plan.done && input.duration <= kLongestStep;
        if (done) state = std::move(*plan.done), report = plan.report;
    }
    effort.substeps = std::max(effort.substeps, static_cast<int>(std::ceil(input.duration / kLongestStep)));
    report.substeps = effort.substeps, report.iterations = effort.iterations;
    const double h = input.duration / effort.substeps;
    bool begun = false;  // a pair of substeps
    for (int k = 0; k < effort.substeps && !done; ++k) {
        const double begin = double(k) / effort.substeps, end = double(k + 1) / effort.substeps;
        if (!progress.report(begin, "simulating")) return cancelled();
        const bool last = k + 1 == effort.substeps;
        const SubstepTime time{stage_of(begun, last), h, begin, end, last};
        Hit hit;
        if (Status ok = advance(context, time, io_state, report, hit); !ok) return ok.error();
        begun = time.stage == Stage::first;
        if (hit.parts == 1) continue;
        if (Status ok = advance_hit(context, hit, time, progress, io_state, report, begun); !ok) return ok.error();
    }
    if (anything_sleeps(io_state)) awake.leave(threads, io_state);
    if (settings.sleeping) report.n_components = fall_asleep(scene, input, settings.self_collision, before, io_state);
    report.asleep = static_cast<size_t>(std::ranges::count(io_state.asleep, 1));
    return report;
}

Result<StepReport> Solver::advance(const FrameInput& input, const SolverSettings& settings, const FrameState& before,
                                   FrameState& o_after, const Progress& progress) {
    if (Status ok = settings.check("solver"); !ok) return ok.error();
    if (Status ok = impl_->check_input(input); !ok) return ok.error();
    if (Status ok = check_state(before); !ok) return ok.error();

    o_after = before;
    o_after.broken.clear();
    add_bending(impl_->scene.rest, input.materials, o_after);
    using Clock = std::chrono::steady_clock;
    std::optional<ThreadTrial>& trial = impl_->trial;
    const WorkerPool& threads = trial && trial->alone() ? impl_->alone : *impl_->workers;
    const Clock::time_point begin = Clock::now();
    Result<StepReport> report = [&] {
        try {
            return impl_->run_frame(input, settings, before, threads, o_after, progress);
        } catch (...) {  // out of memory, or a bug: scratch may be half written
            impl_->forget();
            throw;
        }
    }();
    if (report && trial) trial->took(std::chrono::duration<double>(Clock::now() - begin).count());
    return report;
}

Result<StepReport> Solver::advance(const FrameInput& input, const SolverSettings& settings, FrameState& io_state,
                                   const Progress& progress) {
    FrameState after;
    Result<StepReport> report = advance(input, settings, io_state, after, progress);
    if (report) io_state = std::move(after);
    return report;
}

std::vector<PieceId> connected_pieces(const SimulationMesh& rest, const std::vector<uint8_t>& edge_intact) {
    SimulationMesh joined;  // the edges are enough: the caller's one-rings need not be built
    joined.rest_position = rest.rest_position;
    joined.edges = rest.edges;
    build_one_rings(joined);
    LiveTopology live;
    live.reset(joined, edge_intact);
    return {live.pieces().begin(), live.pieces().end()};
}

}  // namespace sunder
