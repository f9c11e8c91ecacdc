#include "solver/solver.h"

#include <chrono>
#include <optional>
#include <utility>

#include "solver/frame/activation.h"
#include "solver/frame/frame_steps.h"
#include "solver/frame/scene_check.h"
#include "solver/matching/group_shape.h"
#include "solver/matching/thin_groups.h"
#include "solver/material/fading.h"
#include "solver/material/plasticity.h"
#include "solver/threads/thread_trial.h"

namespace sunder {

struct Solver::Impl {
    Scene scene;
    std::shared_ptr<const WorkerPool> workers;
    WorkerPool alone{1};
    std::optional<ThreadTrial> trial;  // of frames on the calling thread alone
    FrameSteps steps{scene};

    Impl(Scene s, std::shared_ptr<const WorkerPool> w) : scene(std::move(s)), workers(std::move(w)) {}
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
    scene.rest.thin = bending_groups(scene.rest);
    scene.rest.flat = flat_groups(scene.rest);
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
            s.yield[i] = yield_strain(rest, i, materials[rest.material_of(i)]);
        }
    }
    add_bending(rest, materials, s);
    add_fading(rest, materials, s);
    add_inactivity(scene, s);
    s.still_time.assign(n + scene.rigid_bodies.size(), 0.0);
    s.asleep.assign(s.still_time.size(), 0);
    s.rest_load.assign(s.still_time.size(), 0.0);
    for (const RigidBody& body : scene.rigid_bodies)
        s.rigid_bodies.push_back({body.pose.position, body.pose.orientation, body.velocity, body.angular_velocity});
    put_to_sleep(scene, s);
    return s;
}

Result<Settled> Solver::settle(const FrameInput& input, const SolverSettings& settings, FrameState& io_state,
                               const Progress& progress) const {
    if (Status ok = settings.check("solver"); !ok) return ok.error();
    if (Status ok = check_input(impl_->scene, input); !ok) return ok.error();
    if (Status ok = check_state(io_state); !ok) return ok.error();
    return sunder::settle(impl_->scene, input, settings, *impl_->workers, progress, io_state);
}

Status Solver::check_state(const FrameState& state) const {
    return sunder::check_state(impl_->scene, state, *impl_->workers);
}

Result<StepReport> Solver::advance(const FrameInput& input, const SolverSettings& settings, const FrameState& before,
                                   FrameState& o_after, const Progress& progress) {
    if (Status ok = settings.check("solver"); !ok) return ok.error();
    if (Status ok = check_input(impl_->scene, input); !ok) return ok.error();
    if (Status ok = check_state(before); !ok) return ok.error();

    o_after = before;
    o_after.broken.clear();
    add_bending(impl_->scene.rest, input.materials, o_after);
    add_fading(impl_->scene.rest, input.materials, o_after);
    add_inactivity(impl_->scene, o_after);
    for (size_t i = 0; i < o_after.n_particles() && !input.yield_changes.empty(); ++i)
        o_after.yield[i] *= input.yield_changes[impl_->scene.rest.material_of(i)];
    using Clock = std::chrono::steady_clock;
    std::optional<ThreadTrial>& trial = impl_->trial;
    const WorkerPool& threads = trial && trial->alone() ? impl_->alone : *impl_->workers;
    const Clock::time_point begin = Clock::now();
    Result<StepReport> report = [&] {
        try {
            return impl_->steps.run(input, settings, before, threads, o_after, progress);
        } catch (...) {  // out of memory, or a bug: scratch may be half written
            impl_->steps.forget();
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
