#include <cmath>
#include <limits>
#include <map>

#include "tests/benchmarks/chart/cases.h"

namespace sunder::chart {
namespace {

Material soft() {
    Material material;
    material.youngs_modulus = 6e5;
    return material;
}

// Held at 60 degrees long enough to be at rest.
const FrameState& held(int cells) {
    static std::map<int, FrameState> states;
    if (const auto known = states.find(cells); known != states.end()) return known->second;
    MovedBar bar({Mover::projective, cells, 8, 2}, soft());
    bar.turn(0, M_PI / 3, 1, 5);
    bar.turn(M_PI / 3, M_PI / 3, 3, 5);
    FrameState state = bar.state;
    for (size_t i = 0; i < state.n_particles(); ++i) state.velocity[i].setZero(), state.angular_velocity[i].setZero();
    return states[cells] = state;
}

// Twice the time from letting go to the first crossing of zero, s; NaN when there is none in `seconds`.
double half_period(MovedBar& io_bar, double seconds, bool to_the_end) {
    io_bar.state = held(io_bar.setting.cells);
    const double h = 1.0 / 24 / io_bar.setting.substeps;
    io_bar.setting.substeps = 1;  // every step is looked at
    const int steps = static_cast<int>(std::lround(seconds / h));
    double last = io_bar.twist(), found = std::numeric_limits<double>::quiet_NaN();
    for (int k = 0; k < steps; ++k) {
        if (!io_bar.frame(h, {}, {}, false)) return std::numeric_limits<double>::quiet_NaN();
        if (!std::isnan(found)) continue;
        const double now = io_bar.twist();
        if (now <= 0) found = 2 * h * (k + last / (last - now));
        if (now <= 0 && !to_the_end) break;
        last = now;
    }
    return found;
}

double limit(int cells) {
    static std::map<int, double> limits;
    if (const auto known = limits.find(cells); known != limits.end()) return known->second;
    MovedBar bar({Mover::projective, cells, 320, 3}, soft());
    return limits[cells] = half_period(bar, 0.25, false);
}

}  // namespace

Outcome release_period(const Setting& setting) {
    MovedBar bar(setting, soft());
    const double found = half_period(bar, 0.25, true);
    return outcome(bar, found, limit(setting.cells));
}

}  // namespace sunder::chart
