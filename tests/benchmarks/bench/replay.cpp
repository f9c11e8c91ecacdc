// The deformers alone, on the states of a recording. Instructions of a frame: under valgrind, twice, and the difference
//
//   valgrind --tool=callgrind --toggle-collect='sunder::VisualMeshBuilder::build*' sunder_replay FILE --repeats 1
//   --frames 3:8
//
// Apart from the benchmark, because CGAL does not start where rounding modes are emulated.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <ctime>

#include "tests/benchmarks/bench/measure.h"
#include "tests/benchmarks/bench/skin_recording.h"
#include "tests/benchmarks/bench/skins.h"

namespace sunder::bench {
namespace {

// Of a frame: wall clock and processor time, s, each the least of the repeats; page faults of the first.
struct Cost {
    double wall, processor;
    long faults;
};

struct Meter {
    static double seconds(clockid_t clock) {
        timespec t{};
        clock_gettime(clock, &t);
        return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
    }
    static Cost now() {
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        return {seconds(CLOCK_MONOTONIC), seconds(CLOCK_PROCESS_CPUTIME_ID), usage.ru_minflt};
    }
};

struct Options {
    std::string path;
    int threads = 1, repeats = 3;
    std::string frames;
    bool each = false;
};

// "A:B", counted from 1, both included.
std::pair<size_t, size_t> frame_range(const std::string& text, size_t n) {
    size_t first = 1, last = n;
    if (!text.empty() && std::sscanf(text.c_str(), "%zu:%zu", &first, &last) != 2)
        throw std::runtime_error("--frames: it is no range of frames, such as 3:8");
    if (first < 1 || first > last || last > n)
        throw std::runtime_error("--frames: the recording has frames 1:" + std::to_string(n));
    return {first - 1, last};
}

void replay(const Options& options) {
    const SkinRecording r = read_recording(options.path);
    const auto [begin, end] = frame_range(options.frames, r.frames.size());
    const WorkerPool workers(options.threads);
    std::vector<Cost> least;
    size_t vertices = 0, triangles = 0;
    uint64_t hash = 0;
    for (int k = 0; k < options.repeats; ++k) {
        Skins skins(r.scene);
        for (size_t f = begin; f < end; ++f) {
            const Cost before = Meter::now();
            skins.build(r.scene, r.frames[f], workers);
            const Cost after = Meter::now();
            const Cost cost{after.wall - before.wall, after.processor - before.processor, after.faults - before.faults};
            if (k == 0)
                least.push_back(cost);
            else
                least[f - begin] = {std::min(least[f - begin].wall, cost.wall),
                                    std::min(least[f - begin].processor, cost.processor), least[f - begin].faults};
        }
        if (k > 0 && hash != skins.hash()) throw std::runtime_error("a repeat gave other bits");
        vertices = skins.vertices(), triangles = skins.triangles(), hash = skins.hash();
    }
    if (options.each)
        for (size_t i = 0; i < least.size(); ++i)
            std::printf("%4zu %8.2f ms %8.2f ms of processor %7ld page faults\n", begin + i + 1, 1e3 * least[i].wall,
                        1e3 * least[i].processor, least[i].faults);
    const auto milliseconds = [&](double Cost::*what, double q) {
        std::vector<double> values;
        for (const Cost& c : least) values.push_back(1e3 * c.*what);
        return quantile(values, q);
    };
    std::printf("median %.2f p99 %.2f ms, of processor %.2f %.2f; %zu vertices %zu triangles; hash %016llx\n",
                milliseconds(&Cost::wall, 0.5), milliseconds(&Cost::wall, 0.99), milliseconds(&Cost::processor, 0.5),
                milliseconds(&Cost::processor, 0.99), vertices, triangles, static_cast<unsigned long long>(hash));
}

}  // namespace
}  // namespace sunder::bench

int main(int argc, char** argv) {
    using namespace sunder::bench;
    CLI::App app("The deformers alone, on the states of a recording", "sunder_replay");
    Options options;
    app.add_option("FILE", options.path, "of sunder_record")->required();
    app.add_option("--threads", options.threads, "[1]")->check(CLI::Range(1, 1024));
    app.add_option("--repeats", options.repeats, "a frame's time is the least of these [3]")
        ->check(CLI::Range(1, 1000));
    app.add_option("--frames", options.frames, "A:B, counted from 1 [all]; all is new in the first of them");
    app.add_flag("--each", options.each, "a line a frame");
    CLI11_PARSE(app, argc, argv);
    try {
        replay(options);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "sunder: error: %s\n", e.what());
        return 1;
    }
    return 0;
}
