// Speed against accuracy: sweeps methods, particles, substeps and iterations over the four cases and writes a csv with
// one row a run.
//
//   sunder_chart FILE.csv [--short]
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>

#include "solver/presets.h"
#include "tests/benchmarks/chart/cases.h"

namespace sunder::chart {
namespace {

struct Sweep {
    std::vector<int> cells, substeps, iterations;
    std::vector<double> budgets;
    double longest_run;  // s; settings expected to take longer are left out
    int repeats;
};

constexpr int kOneMesh = 4;  // cells across: where presets are shown, and cases whose limit is the mesh's own

const Sweep kFull = {{2, 4, 6, 8}, {1, 2, 4, 8, 16, 32, 64, 128}, {1, 2, 4}, {0.1, 0.05, 0.02, 0.01}, 1.0, 2};
const Sweep kShort = {{2, 4}, {1, 2, 8, 32}, {1, 2}, {0.1, 0.02}, 0.3, 1};

// About; only to leave out what would take too long.
double expected_seconds(const Setting& s, double simulated_s) {
    const double seconds_per_particle_and_sweep = s.mover == Mover::projective ? 2e-6 : 1.5e-6;
    return simulated_s * 24 * s.substeps * s.iterations * s.particles() * seconds_per_particle_and_sweep;
}

// The runs give the same bits, so that each frame's cost is the least of its repeats: what else the machine does can
// only add to it.
Outcome measure(const Case& a_case, const Setting& setting, int repeats) {
    Outcome best = a_case.run(setting);
    for (int k = 1; k < repeats; ++k) {
        const Outcome again = a_case.run(setting);
        for (size_t f = 0; f < best.frame_cpu.size(); ++f)
            best.frame_cpu[f] = std::min(best.frame_cpu[f], again.frame_cpu[f]);
    }
    return best;
}

// The preset that a setting is, on the mesh that presets are shown on.
std::string_view preset_of(const Setting& s) {
    for (const Preset& p : kPresets)
        if (s.mover == Mover::projective && s.error_budget == 0 && p.substeps == s.substeps &&
            p.iterations == s.iterations && s.cells == kOneMesh)
            return p.name;
    return "";
}

void write_row(std::FILE* file, const char* case_name, const Setting& s, const Outcome& o) {
    double cpu = 0;
    for (const double t : o.frame_cpu) cpu += t;
    const double substeps = s.error_budget > 0 ? o.substeps / (24 * o.simulated_s) : s.substeps;
    std::fprintf(file, "%s,%s,%d,%.4g,%d,%g,%.6g,%.6g,%.6g,%.6g,%s\n", case_name, name_of(s.mover), s.particles(),
                 substeps, s.iterations, s.error_budget, cpu / o.simulated_s, o.error, o.value, o.reference,
                 preset_of(s).data());
    std::fflush(file);
}

void run(const Sweep& sweep, std::FILE* file) {
    std::fprintf(file,
                 "case,method,particles,substeps,iterations,error_budget,cpu_s_per_s,error,value,reference,preset\n");
    for (const Case& a_case : kCases)
        for (const int cells : sweep.cells) {
            if (!a_case.many_meshes && cells != kOneMesh) continue;
            for (const Mover mover :
                 {Mover::projective, Mover::jacobi, Mover::gauss_seidel, Mover::plain, Mover::plain_corrected})
                for (const int substeps : sweep.substeps)
                    for (const int iterations : sweep.iterations) {
                        const Setting setting{mover, cells, substeps, iterations};
                        if (expected_seconds(setting, a_case.simulated_s) > sweep.longest_run) continue;
                        write_row(file, a_case.name, setting, measure(a_case, setting, sweep.repeats));
                    }
            if (cells != kOneMesh) continue;
            for (const double budget : sweep.budgets) {
                Setting setting{Mover::projective, cells};
                setting.error_budget = budget;
                write_row(file, a_case.name, setting, measure(a_case, setting, sweep.repeats));
            }
        }
}

}  // namespace
}  // namespace sunder::chart

int main(int argc, char** argv) {
    const bool is_short = argc == 3 && std::strcmp(argv[2], "--short") == 0;
    if (argc < 2 || argv[1][0] == '-' || (argc == 3 && !is_short) || argc > 3) {
        std::fprintf(stderr, "usage: sunder_chart FILE.csv [--short]\n");
        return 2;
    }
    std::FILE* file = std::fopen(argv[1], "w");
    if (!file) {
        std::fprintf(stderr, "sunder: error: %s: cannot be written\n", argv[1]);
        return 1;
    }
    try {
        sunder::chart::run(is_short ? sunder::chart::kShort : sunder::chart::kFull, file);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "sunder: error: %s\n", e.what());
        return 1;
    }
    return std::fclose(file) == 0 ? 0 : 1;
}
