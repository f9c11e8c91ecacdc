#include "tests/benchmarks/chart/moved_bar.h"

#include <time.h>

#include <cmath>
#include <stdexcept>

#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "fracture_tools/lattice.h"

namespace sunder::chart {
namespace {

double thread_seconds() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

template <class T>
T unwrap(Result<T> result) {
    if (!result) throw std::runtime_error(result.error().text());
    return result.take();
}

Scene bar_scene(int cells) {
    LatticeSettings lattice;
    lattice.size = Vec3(0.2, 0.2, 1);
    lattice.cells = {cells, cells, 5 * cells};
    lattice.center = Vec3(0, 0, 0.5);
    lattice.neighbours = 6;
    SimulationMeshSettings mesh_settings;
    mesh_settings.density = 1000;
    Scene scene;
    append_body(scene.rest, unwrap(build_simulation_mesh(unwrap(make_lattice(lattice, "bar")), mesh_settings)), {});
    Body body;
    body.name = "bar";
    body.particle_end = static_cast<uint32_t>(scene.rest.n_particles());
    body.edge_end = static_cast<uint32_t>(scene.rest.n_edges());
    scene.bodies.push_back(body);
    scene.pins.resize(2);
    scene.pins[0].name = "foot", scene.pins[1].name = "head";
    for (uint32_t i = 0; i < body.particle_end; ++i) {
        const double z = scene.rest.rest_position[i].z();
        if (z < 0.1) scene.pins[0].particles.push_back(ParticleId(i));
        if (z > 0.9) scene.pins[1].particles.push_back(ParticleId(i));
    }
    return scene;
}

}  // namespace

const char* name_of(Mover mover) {
    constexpr const char* names[] = {"projective", "jacobi", "gauss_seidel", "plain", "plain_corrected"};
    return names[int(mover)];
}

bool is_solver(Mover mover) { return mover != Mover::plain && mover != Mover::plain_corrected; }

Method method_of(Mover mover) {
    return mover == Mover::jacobi         ? Method::jacobi
           : mover == Mover::gauss_seidel ? Method::gauss_seidel
                                          : Method::projective;
}

Pose turned(double angle) { return {Vec3::Zero(), Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ()))}; }

MovedBar::MovedBar(const Setting& s, const Material& material)
    : setting(s), scene_(bar_scene(s.cells)), material_(material) {
    solver_ = unwrap(Solver::create(scene_, 1));
    state = solver_->initial_state({material});
    if (!is_solver(s.mover)) plain_ = std::make_unique<test::PlainMethod>(scene_);
}

bool MovedBar::frame(double duration, const Pose& begin, const Pose& end, bool held, double damping) {
    FrameInput input;
    input.duration = duration;
    input.gravity = Vec3::Zero();
    input.materials = {material_};
    input.pins = {DrivenPose(), {begin, end, held}};
    const double start = thread_seconds();
    bool sound = true;
    if (plain_) {
        test::PlainSettings s;
        s.substeps = setting.substeps, s.iterations = setting.iterations, s.damping = damping;
        s.correct_momentum = setting.mover == Mover::plain_corrected;
        s.flow_per_step = -std::expm1(-material_.flow_rate / kPlainTunedRate);
        s.max_speed = 1e5;  // where the solver, too, gives up
        sound = plain_->advance(input, s, state);
        last_substeps = s.substeps;
    } else {
        SolverSettings s;
        s.method = method_of(setting.mover);
        s.substeps = setting.substeps, s.iterations = setting.iterations, s.damping = damping;
        s.error_budget = setting.error_budget;
        const auto report = solver_->advance(input, s, state);
        sound = bool(report);
        last_substeps = sound ? report->substeps : s.substeps;
    }
    frame_cpu.push_back(thread_seconds() - start);
    simulated_s += duration;
    total_substeps += last_substeps;
    return sound;
}

bool MovedBar::turn(double from, double to, double seconds, double damping) {
    const int frames = std::max(1, static_cast<int>(std::lround(seconds * 24)));
    for (int f = 0; f < frames; ++f)
        if (!frame(seconds / frames, turned(from + (to - from) * f / frames),
                   turned(from + (to - from) * (f + 1) / frames), true, damping))
            return false;
    return true;
}

bool MovedBar::let_go(double seconds, double damping) {
    const int frames = static_cast<int>(std::lround(seconds * 24));
    for (int f = 0; f < frames; ++f)
        if (!frame(seconds / frames, {}, {}, false, damping)) return false;
    return true;
}

double MovedBar::twist() const {
    const size_t in_layer = static_cast<size_t>(setting.cells * setting.cells);
    double total = 0, last = 0;
    for (size_t first = 0; first < state.n_particles(); first += in_layer) {
        Vec3 center = Vec3::Zero();
        for (size_t i = first; i < first + in_layer; ++i) center += state.position[i] / double(in_layer);
        double cosine = 0, sine = 0;
        for (size_t i = first; i < first + in_layer; ++i) {
            const Vec3 &a = rest().rest_position[i], b = state.position[i] - center;
            cosine += a.x() * b.x() + a.y() * b.y(), sine += a.x() * b.y() - a.y() * b.x();
        }
        const double angle = std::atan2(sine, cosine);
        total += std::remainder(angle - last, 2 * M_PI);
        last = angle;
    }
    return total;
}

}  // namespace sunder::chart
