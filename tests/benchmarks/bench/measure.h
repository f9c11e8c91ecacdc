// One scene run and timed.
#pragma once

#include <cstdint>
#include <string>

#include "tests/benchmarks/bench/lying.h"
#include "tests/benchmarks/bench/scenes.h"

namespace sunder::bench {

/// Of the measured frames; a frame's time is the least of the repeats, which give the same bits.
struct Measurement {
    size_t particles = 0, edges = 0, members = 0;  // members: of all groups together
    size_t pieces = 0, contacts = 0;               // at the end
    int frames = 0, substeps = 0, iterations = 0;
    double least_ms = 0, median_ms = 0, slowest_ms = 0;  // solver, a frame; slowest: 99th percentile
    double predict = 0, shape = 0, contact = 0, momentum = 0, fracture = 0;  // shares of the solver's time
    double ns_group = 0;                           // shape matching, a group and iteration (a sweep of method jacobi)
    double skin_ms = 0, skin_slowest_ms = 0;       // deformers of all bodies, a frame: median, 99th percentile
    size_t skin_vertices = 0, skin_triangles = 0;  // at the end
    double peak_mb = 0;                            // of the process that made the scene and ran it
    double gigahertz = 0;  // of a chain of dependent additions beside the run: the clock as it was
    uint64_t hash = 0;     // of the last state
    Lying lies;            // at the end
};

/// `frames` 0: as many as the scene says. Throws std::runtime_error with the core's text.
Measurement measure(const NamedScene& scene, const std::string& method, int threads, int frames, int repeats);

/// Of values of which the q-th part is no larger, 0 <= q <= 1.
double quantile(std::vector<double> values, double q);

/// The clock as it is now, from a chain of dependent additions: GHz.
double clock_gigahertz();

}  // namespace sunder::bench
