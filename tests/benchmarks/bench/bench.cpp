// Speed of the solver and the deformer on named scenes; a table on standard output, and a csv.
//
//   sunder_bench [SCENE]... [--all] [--threads 1,2] [--method NAME] [--frames N] [--repeats N] [--csv FILE] [--label
//   TEXT]
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fstream>

#include "tests/benchmarks/bench/bullet.h"
#include "tests/benchmarks/bench/measure.h"

namespace sunder::bench {
namespace {

struct Options {
    std::vector<std::string> scenes, methods = {"projective"};
    std::vector<int> threads = {1};
    int repeats = 3, frames = 0;  // frames 0: as many as the scene says
    bool all = false;
    std::string csv, label;
};

std::string processor() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);)
        if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
    return "unknown";
}

constexpr const char* kColumns =
    "label,processor,scene,method,threads,particles,edges,members,substeps,iterations,frames,least_ms,median_ms,p99_ms,"
    "ns_group,predict,shape,contact,momentum,fracture,pieces,contacts,skin_ms,skin_p99_ms,skin_vertices,skin_triangles,"
    "peak_mb,ghz,"
    "hash,speed_p50,speed_p90,below_floor";

void print_row(const Measurement& m, const char* scene, const std::string& method, int threads) {
    std::printf(
        "%-9s %-11s %2d %8zu %6.1f %9.3f %9.3f %9.3f %8.1f  %3.0f %3.0f %3.0f %3.0f %3.0f %7zu %8.2f %8.2f %8zu %7.0f "
        "%5.2f\n",
        scene, method.c_str(), threads, m.particles, double(m.members) / double(m.particles), m.least_ms, m.median_ms,
        m.slowest_ms, m.ns_group, 100 * m.predict, 100 * m.shape, 100 * m.contact, 100 * m.momentum, 100 * m.fracture,
        m.pieces, m.skin_ms, m.skin_slowest_ms, m.skin_vertices, m.peak_mb, m.gigahertz);
    std::fflush(stdout);
}

void write_row(std::FILE* csv, const Options& options, const Measurement& m, const char* scene,
               const std::string& method, int threads) {
    std::fprintf(
        csv,
        "%s,\"%s\",%s,%s,%d,%zu,%zu,%zu,%d,%d,%d,%.4f,%.4f,%.4f,%.2f,%.3f,%.3f,%.3f,%.3f,%.3f,%zu,%zu,%.3f,%.3f,"
        "%zu,%zu,%.0f,%.2f,%016llx,%.3g,%.3g,%.3g\n",
        options.label.c_str(), processor().c_str(), scene, method.c_str(), threads, m.particles, m.edges, m.members,
        m.substeps, m.iterations, m.frames, m.least_ms, m.median_ms, m.slowest_ms, m.ns_group, m.predict, m.shape,
        m.contact, m.momentum, m.fracture, m.pieces, m.contacts, m.skin_ms, m.skin_slowest_ms, m.skin_vertices,
        m.skin_triangles, m.peak_mb, m.gigahertz, static_cast<unsigned long long>(m.hash), m.lies.speed_p50,
        m.lies.speed_p90, m.lies.below_floor);
}

// In a process of its own, so that its peak of memory is the scene's.
bool run_apart(const Options& options, std::FILE* csv, const NamedScene& scene, const std::string& method,
               int threads) {
    std::fflush(nullptr);
    const pid_t child = fork();
    if (child < 0) return false;
    if (child == 0) {
        int status = 0;
        try {
            const Measurement m = method == "bullet" ? measure_bullet(scene, options.frames, options.repeats)
                                                     : measure(scene, method, threads, options.frames, options.repeats);
            print_row(m, scene.name, method, threads);
            if (csv) write_row(csv, options, m, scene.name, method, threads);
        } catch (const std::exception& e) {
            std::fprintf(stderr, "sunder: error: %s: %s\n", scene.name, e.what());
            status = 1;
        }
        std::fflush(nullptr);
        _exit(status);
    }
    int status = 0;
    return waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

bool run(const Options& options, std::FILE* csv) {
    std::printf("%-9s %-11s %2s %8s %6s %9s %9s %9s %8s  %-19s %7s %8s %8s %8s %7s %5s\n", "scene", "method", "th",
                "groups", "ring", "least ms", "median", "p99", "ns/group", "pre sha con mom fra", "pieces", "skin ms",
                "skin p99", "vertices", "MB", "GHz");
    bool good = true;
    for (const NamedScene& scene : all_scenes()) {
        const bool named = std::find(options.scenes.begin(), options.scenes.end(), scene.name) != options.scenes.end();
        if (!named && !options.all && (scene.long_run || !options.scenes.empty())) continue;
        for (const std::string& method : options.methods)
            for (const int threads : options.threads)
                if (method != "bullet" || (bullet_knows(scene.name) && threads == 1))
                    good &= run_apart(options, csv, scene, method, threads);
    }
    return good;
}

std::vector<std::string> scene_names() {
    std::vector<std::string> names;
    for (const NamedScene& scene : all_scenes()) names.push_back(scene.name);
    return names;
}

std::string scene_list() {
    std::string text = "Scenes:\n";
    for (const NamedScene& scene : all_scenes())
        text += "  " + std::string(scene.name) + std::string(10 - std::string(scene.name).size(), ' ') + scene.what +
                (scene.long_run ? " (by name or --all)" : "") + "\n";
    return text;
}

}  // namespace
}  // namespace sunder::bench

int main(int argc, char** argv) {
    using namespace sunder::bench;
    CLI::App app("Speed of the solver and the deformer on named scenes", "sunder bench");
    app.footer(scene_list());
    Options options;
    app.add_option("SCENE", options.scenes, "which (all but the long ones)")->check(CLI::IsMember(scene_names()));
    app.add_flag("--all", options.all, "the long ones, too");
    app.add_option("--threads", options.threads, "numbers of threads [1]")->delimiter(',')->check(CLI::Range(1, 1024));
    app.add_option(
           "--method", options.methods,
           "solver methods; bullet: bars as its soft bodies, rubble as its rigid ones, on one thread [projective]")
        ->delimiter(',')
        ->check(CLI::IsMember({"projective", "jacobi", "gauss_seidel", "bullet"}));
    app.add_option("--frames", options.frames, "measured frames [the scene's own]")->check(CLI::Range(1, 100000));
    app.add_option("--repeats", options.repeats, "a frame's time is the least of these [3]")->check(CLI::Range(1, 100));
    app.add_option("--csv", options.csv, "file to append rows to");
    app.add_option("--label", options.label, "first column of the csv, e.g. the commit");
    CLI11_PARSE(app, argc, argv);

    std::FILE* csv = nullptr;
    if (!options.csv.empty()) {
        csv = std::fopen(options.csv.c_str(), "a");
        if (!csv) {
            std::fprintf(stderr, "sunder: error: %s: cannot be written\n", options.csv.c_str());
            return 1;
        }
        if (std::ftell(csv) == 0) std::fprintf(csv, "%s\n", kColumns);
    }
    const bool good = run(options, csv);
    return (!csv || std::fclose(csv) == 0) && good ? 0 : 1;
}
