// How much of a scene breaks, in the mean of shots that hardly differ: what breaks in
// `bunnies` varies by 4 % from shot to shot (standard deviation).
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/benchmarks/bench/scene_parts.h"

namespace sunder::bench {
namespace {

struct Mean {
    double value, standard_error;
};
Mean mean(const std::vector<double>& samples) {
    const auto n = static_cast<double>(samples.size());
    double sum = 0, squares = 0;
    for (double x : samples) sum += x;
    for (double x : samples) squares += (x - sum / n) * (x - sum / n);
    return {sum / n, std::sqrt(squares / (n * (n - 1)))};
}

struct Options {
    int shots = 32, threads = 0, frames = 0, substeps = 0, iterations = 0, crack_passes = 0,
        hit_substeps = 0;  // 0: the scene's own
    double spread = 0.03, error_budget = 0, stiffer = 1;
};

void shoot(const NamedScene& named, const Options& options) {
    const int shots = options.shots;
    const double spread = options.spread;
    BenchScene s = named.make();
    if (options.substeps > 0) s.settings.substeps = options.substeps;
    if (options.iterations > 0) s.settings.iterations = options.iterations;
    if (options.crack_passes > 0) s.settings.crack_passes = options.crack_passes;
    if (options.hit_substeps > 0) s.settings.hit_substeps = options.hit_substeps;
    s.settings.error_budget = options.error_budget;
    for (Material& m : s.input.materials) {
        const double speed = std::sqrt(options.stiffer);  // of waves
        m.youngs_modulus *= options.stiffer, m.toughness /= speed, m.yield /= speed;
    }
    const auto solver = must(Solver::create(std::move(s.scene), options.threads));
    const int frames = options.frames > 0 ? options.frames : s.frames;
    std::vector<double> edges, pieces;
    for (int shot = 0; shot < shots; ++shot) {
        FrameInput input = s.input;
        for (Material& m : input.materials) m.toughness *= 1 - spread + 2 * spread * shot / (shots - 1);
        FrameState state = solver->initial_state(input.materials);
        size_t n_pieces = 0;
        for (int frame = 0; frame < s.warm_up + frames; ++frame) {
            if (s.drive) s.drive(frame, input);
            const auto report = solver->advance(input, s.settings, state);
            if (!report) throw std::runtime_error(report.error().text());
            n_pieces = report->n_components;
        }
        edges.push_back(static_cast<double>(std::ranges::count(state.edge_intact, 0)));
        pieces.push_back(static_cast<double>(n_pieces));
    }
    const Mean broken = mean(edges), parts = mean(pieces);
    std::printf("%s: edges broken %.1f, standard error %.1f; pieces %.1f, %.1f; %d shots, toughness %g to %g times\n",
                named.name, broken.value, broken.standard_error, parts.value, parts.standard_error, shots, 1 - spread,
                1 + spread);
}

}  // namespace
}  // namespace sunder::bench

int main(int argc, char** argv) {
    using namespace sunder::bench;
    CLI::App app("How much of a benchmark scene breaks, in the mean of shots of nearly the same toughness",
                 "sunder_breaking");
    std::string scene;
    Options options;
    std::vector<std::string> names;
    for (const NamedScene& named : all_scenes()) names.push_back(named.name);
    app.add_option("SCENE", scene, "one in which things break: bunnies, paper")
        ->required()
        ->check(CLI::IsMember(names));
    app.add_option("--shots", options.shots, "how many")->capture_default_str()->check(CLI::Range(2, 10000));
    app.add_option("--spread", options.spread, "of the toughness, to either side")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 0.5));
    app.add_option("--threads", options.threads, "0: all")->capture_default_str()->check(CLI::Range(0, 1024));
    app.add_option("--frames", options.frames, "[the scene's own]")->check(CLI::Range(1, 100000));
    app.add_option("--substeps", options.substeps, "[the scene's own]")->check(CLI::Range(1, 1000));
    app.add_option("--iterations", options.iterations, "[the scene's own]")->check(CLI::Range(1, 1000));
    app.add_option("--crack-passes", options.crack_passes, "[the scene's own]")->check(CLI::Range(1, 64));
    app.add_option("--hit-substeps", options.hit_substeps, "[the scene's own]")->check(CLI::Range(1, 256));
    app.add_option("--stiffer", options.stiffer,
                   "how many times: toughness and yield fall by the root of it, as strains of hits do")
        ->capture_default_str()
        ->check(CLI::Range(1e-3, 1e6));
    app.add_option("--error-budget", options.error_budget, "0: none")->check(CLI::Range(0.0, 1.0));
    CLI11_PARSE(app, argc, argv);
    try {
        for (const NamedScene& named : all_scenes())
            if (named.name == scene) shoot(named, options);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "sunder: error: %s\n", e.what());
        return 1;
    }
    return 0;
}
