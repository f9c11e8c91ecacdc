#include "tests/benchmarks/bench/measure.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "solver/threads/parallel.h"
#include "tests/benchmarks/bench/skins.h"

namespace sunder::bench {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct Times {
    std::vector<double> solver, skin;  // s, a frame
    StepReport sum;
    std::vector<Vec3> before;  // positions a frame before the end, m
};

Times run(const BenchScene& s, Solver& solver, const WorkerPool& workers, Skins& skins, FrameState& io_state) {
    Times times;
    FrameInput input = s.input;
    for (int frame = 0; frame < s.warm_up + s.frames; ++frame) {
        if (s.drive) s.drive(frame, input);
        times.before = io_state.position;
        auto start = Clock::now();
        const auto report = solver.advance(input, s.settings, io_state);
        if (!report) throw std::runtime_error(report.error().text());
        if (frame < s.warm_up) continue;
        times.solver.push_back(seconds_since(start));
        start = Clock::now();
        skins.build(s, io_state, workers);
        times.skin.push_back(seconds_since(start));
        StepReport& sum = times.sum;
        sum.predict_s += report->predict_s, sum.shape_s += report->shape_s, sum.contact_s += report->contact_s;
        sum.momentum_s += report->momentum_s, sum.fracture_s += report->fracture_s;
        sum.substeps += report->substeps, sum.contacts = report->contacts, sum.n_components = report->n_components;
        sum.iterations = report->iterations;
    }
    return times;
}

void keep_least(std::vector<double>& io_best, const std::vector<double>& other) {
    for (size_t i = 0; i < io_best.size(); ++i) io_best[i] = std::min(io_best[i], other[i]);
}

Method method_named(const std::string& name) {
    if (name == "jacobi") return Method::jacobi;
    if (name == "gauss_seidel") return Method::gauss_seidel;
    return Method::projective;
}

}  // namespace

// A dependent addition takes one cycle on every processor of these years.
double clock_gigahertz() {
    constexpr uint64_t kAdditions = 20'000'000;
    uint64_t sum = 0;
    const auto start = Clock::now();
    for (uint64_t i = 0; i < kAdditions; ++i) {
        sum += i;
        asm volatile("" : "+r"(sum));
    }
    return kAdditions / seconds_since(start) * 1e-9;
}

double quantile(std::vector<double> values, double q) {
    std::sort(values.begin(), values.end());
    return values[static_cast<size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

Measurement measure(const NamedScene& named, const std::string& method, int threads, int frames, int repeats) {
    BenchScene s = named.make();
    if (frames > 0) s.frames = frames;
    s.settings.method = method_named(method);
    const auto workers = std::make_shared<const WorkerPool>(threads);
    auto created = Solver::create(std::move(s.scene), workers);
    if (!created) throw std::runtime_error(created.error().text());
    const std::unique_ptr<Solver> solver = created.take();
    if (!s.skins.empty()) s.scene = solver->scene();  // with its one-rings

    Measurement m;
    m.gigahertz = clock_gigahertz();
    Times best;
    for (int k = 0; k < repeats; ++k) {
        Skins skins(s);
        FrameState state = solver->initial_state(s.input.materials);
        const Times times = run(s, *solver, *workers, skins, state);
        const uint64_t hash = state_hash(state);
        if (k > 0 && hash != m.hash) throw std::runtime_error(std::string(named.name) + ": a repeat gave other bits");
        m.hash = hash;
        m.lies = how_things_lie(*solver, s.input.duration, times.before, state.position, state.orientation);
        m.skin_vertices = skins.vertices(), m.skin_triangles = skins.triangles();
        if (k == 0)
            best = times;
        else
            keep_least(best.solver, times.solver), keep_least(best.skin, times.skin);
    }
    m.gigahertz = std::max(m.gigahertz, clock_gigahertz());

    const SimulationMesh& rest = solver->scene().rest;
    m.particles = rest.n_particles(), m.edges = rest.n_edges(), m.members = rest.group_member.size();
    m.pieces = best.sum.n_components, m.contacts = best.sum.contacts;
    m.frames = s.frames, m.substeps = best.sum.substeps / s.frames, m.iterations = best.sum.iterations;
    m.least_ms = 1e3 * quantile(best.solver, 0), m.median_ms = 1e3 * quantile(best.solver, 0.5);
    m.slowest_ms = 1e3 * quantile(best.solver, 0.99), m.skin_ms = 1e3 * quantile(best.skin, 0.5);
    m.skin_slowest_ms = 1e3 * quantile(best.skin, 0.99);
    const StepReport& t = best.sum;
    const double all = t.predict_s + t.shape_s + t.contact_s + t.momentum_s + t.fracture_s;
    const double total = all > 0 ? all : 1;  // 0 where everything slept
    m.predict = t.predict_s / total, m.shape = t.shape_s / total, m.contact = t.contact_s / total;
    m.momentum = t.momentum_s / total, m.fracture = t.fracture_s / total;
    m.ns_group = 1e9 * t.shape_s / std::max(1.0, double(m.particles) * t.substeps * t.iterations);
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    m.peak_mb = static_cast<double>(usage.ru_maxrss) / 1024;
    return m;
}

}  // namespace sunder::bench
