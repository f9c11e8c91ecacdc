// What the chart measures: four cases, each a number with a reference.
#pragma once

#include "tests/benchmarks/chart/moved_bar.h"

namespace sunder::chart {

struct Outcome {
    double value = 0, reference = 0;  // in the case's unit; NaN where the method never came to an answer
    double error = 0;                 // relative; infinite where there is no answer
    double simulated_s = 0;
    std::vector<double> frame_cpu;  // s a frame
    double substeps = 0;            // taken in all
};

struct Case {
    const char* name;
    double simulated_s;  // about; what a run costs is estimated from it
    bool many_meshes;    // its reference is the continuum: particles count; else the limit of the mesh itself
    Outcome (*run)(const Setting& setting);
};

/// Held at a twist of 90 degrees: distance from the finite-element field, relative to the displacement (L2).
Outcome held_twist(const Setting& setting);
/// Let go from 60 degrees: half period against the same bar's at 7680 steps a second.
Outcome release_period(const Setting& setting);
/// Twisted by 90 degrees beyond yield (0.02) and let go: the angle that stays, against finite-element J2 plasticity.
Outcome residual_twist(const Setting& setting);
/// Ductile, pulled at 1 m/s: when the first edge breaks, against the same bar at 7680 steps a second.
Outcome tear_time(const Setting& setting);

inline constexpr Case kCases[] = {{"held_twist", 1.25, true, held_twist},
                                  {"release_period", 0.25, false, release_period},
                                  {"residual_twist", 1.75, true, residual_twist},
                                  {"tear_time", 0.25, false, tear_time}};

/// An answer, relative to its reference; NaN: none.
Outcome outcome(const MovedBar& bar, double value, double reference);

/// Numbers of a csv of the finite-element references, comments and heading left out.
std::vector<std::vector<double>> reference_rows(const std::string& file);

}  // namespace sunder::chart
