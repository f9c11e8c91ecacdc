#include "solver/frame/settling.h"

#include <algorithm>
#include <utility>

#include "solver/scene/scales.h"
#include "solver/sleep/awake_scene.h"
#include "solver/step/letting_go.h"

namespace sunder {
namespace {

// Long implicit steps from standstill are nearly Newton steps towards the equilibrium. In steps as long as the shot's
// what touches then finds its forces: it swings there, and is stopped where it moves fastest (kinetic damping: Cundall;
// Barnes 1999).
constexpr int kLoadingSteps = 16;  // in which the load grows, so that nothing is strained beyond it on the way
constexpr int kMostLong = 64;      // where stiff things are within what a solve leaves
constexpr int kMostShort = 600;
constexpr int kLeastIterations = 4;  // else long steps end beside the equilibrium
constexpr double kSettled = 0.04;    // of the acceleration of a fall: who is accelerated by less is at rest

// What stands by in it (AwakeScene).
std::vector<uint8_t> who_stands_by(const Scene& scene) {
    std::vector<uint8_t> stands;
    for (const Body& b : scene.bodies) stands.resize(b.particle_end, b.settles ? 0 : kStandsBy);
    for (const RigidBody& b : scene.rigid_bodies) stands.push_back(b.settles ? 0 : kStandsBy);
    return stands;
}

void stop(FrameState& state) {
    std::ranges::fill(state.velocity, Vec3::Zero());
    std::ranges::fill(state.angular_velocity, Vec3::Zero());
    for (RigidBodyState& b : state.rigid_bodies) b.velocity = b.angular_velocity = Vec3::Zero();
}

double energy_of_motion(const Scene& scene, const FrameState& state) {
    double sum = 0;
    for (size_t i = 0; i < state.n_particles(); ++i) sum += scene.rest.mass[i] * state.velocity[i].squaredNorm();
    for (size_t r = 0; r < state.rigid_bodies.size(); ++r)
        sum += scene.rigid_bodies[r].mass * state.rigid_bodies[r].velocity.squaredNorm();
    return sum / 2;
}

void start(const FrameState& initial, FrameState& state) {
    state.velocity = initial.velocity, state.angular_velocity = initial.angular_velocity;
    for (size_t r = 0; r < state.rigid_bodies.size(); ++r) {
        state.rigid_bodies[r].velocity = initial.rigid_bodies[r].velocity;
        state.rigid_bodies[r].angular_velocity = initial.rigid_bodies[r].angular_velocity;
    }
}

// The end of the frame, at a share of the load.
FrameInput standing(const FrameInput& input, double share) {
    FrameInput in = input;
    in.gravity *= share;
    for (Force& f : in.forces) f.acceleration *= share, f.wind *= share;
    for (std::vector<DrivenPose>* poses : {&in.pins, &in.colliders})
        for (DrivenPose& p : *poses) p.begin = p.end, p.grip.begin = p.grip.end, p.surface.begin = p.surface.end;
    for (std::vector<FrameInput::SourceDrive>* sources : {&in.sources, &in.pin_sources})
        for (FrameInput::SourceDrive& s : *sources) s.begin = s.end;
    return in;
}

void make_unbreakable(std::vector<Material>& materials) {
    for (Material& m : materials) m.toughness = m.compressive_toughness = kNever;
}

struct Way {
    double length = 0;  // m
    MovableId who;
};

// The longest way from one state to another.
Way longest_way(const FrameState& a, const FrameState& b) {
    Way way;
    const auto add = [&](size_t i, const Vec3& from, const Vec3& to) {
        if (const double length = (to - from).norm(); length > way.length) way = {length, MovableId(i)};
    };
    for (size_t i = 0; i < a.n_particles(); ++i) add(i, a.position[i], b.position[i]);
    for (size_t r = 0; r < a.rigid_bodies.size(); ++r)
        add(a.n_particles() + r, a.rigid_bodies[r].position, b.rigid_bodies[r].position);
    return way;
}

// What settles, in steps; the others stand by.
class SettlingScene {
public:
    SettlingScene(const Scene& scene, const SolverSettings& settings, const WorkerPool& threads)
        : scene_(scene), settings_(settings), threads_(threads), margin_(contact_margin(scene)) {}

    Status step(const FrameInput& input, double h, FrameState& io_state) {
        const StepContext whole{scene_, input, settings_, threads_, margin_, {}, false};
        scene_part_.enter(whole, io_state);
        StepReport report;
        const Result<StepOutcome> outcome = scene_part_.step(whole, {Stage::alone, h, 0, 1, true}, io_state, report);
        if (!outcome) return outcome.error();
        scene_part_.leave(threads_, io_state);
        return {};
    }

private:
    const Scene& scene_;
    SolverSettings settings_;
    const WorkerPool& threads_;
    double margin_;  // of contacts, m
    AwakeScene scene_part_;
};

// What breaks and fades in a frame from there.
Status try_to_break(const Scene& scene, const FrameInput& input, const SolverSettings& settings,
                    const WorkerPool& threads, FrameState state, Settled& io_settled) {
    SettlingScene part(scene, settings, threads);
    take_up_bonds(scene, input, state);
    for (int k = 0; k < settings.substeps; ++k)
        if (Status ok = part.step(input, input.duration / settings.substeps, state); !ok) return ok;
    io_settled.breaking = std::move(state.broken);
    for (size_t e = 0; e < state.edge_damage.size(); ++e)
        if (state.edge_intact[e] && state.edge_damage[e] > 0) io_settled.weakening.push_back(EdgeId(e));
    return {};
}

}  // namespace

bool anything_settles(const Scene& scene) {
    const auto settles = [](const auto& body) { return body.settles; };
    return std::ranges::any_of(scene.bodies, settles) || std::ranges::any_of(scene.rigid_bodies, settles);
}

Result<Settled> settle(const Scene& scene, const FrameInput& input, const SolverSettings& settings,
                       const WorkerPool& threads, const Progress& progress, FrameState& io_state) {
    SolverSettings effort = settings;
    effort.method = Method::projective, effort.error_budget = 0, effort.hit_substeps = effort.crack_passes = 1;
    effort.iterations = std::max(settings.iterations, kLeastIterations);
    FrameState state = io_state;
    state.asleep = who_stands_by(scene);
    stop(state);
    SettlingScene part(scene, effort, threads);
    Settled settled;
    int load = 0;  // in loading steps
    for (const bool is_long : {true, false}) {
        const double h = is_long ? std::min(input.duration, kLongestStep) : input.duration / settings.substeps;
        const int most = is_long ? kMostLong : kMostShort;
        double energy = 0;   // of motion, J
        bool stands = true;  // before the step
        settled.at_rest = false;
        for (int k = 1; k <= most && !settled.at_rest; ++k) {
            if (!progress.report(double(k + (is_long ? 0 : kMostLong)) / (kMostLong + kMostShort), "settling"))
                return cancelled();
            load = std::min(load + 1, kLoadingSteps);
            FrameInput in = standing(input, double(load) / kLoadingSteps);
            make_unbreakable(in.materials);
            const FrameState before = state;
            if (Status ok = part.step(in, h, state); !ok) return ok.error();
            const Way way = longest_way(before, state);
            settled.moves = way.who;
            settled.at_rest =
                stands && load == kLoadingSteps && way.length <= kSettled * fall_in_step(h, acceleration_of(in));
            const double former = std::exchange(energy, energy_of_motion(scene, state));
            stands = is_long || energy < former;
            if (stands) stop(state), energy = 0;
        }
    }
    if (Status ok = try_to_break(scene, standing(input, 1), effort, threads, state, settled); !ok) return ok.error();
    start(io_state, state);
    state.time = io_state.time, state.asleep = io_state.asleep;
    io_state = std::move(state);
    return settled;
}

}  // namespace sunder
