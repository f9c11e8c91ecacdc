#include <cmath>
#include <limits>
#include <map>

#include "tests/benchmarks/chart/cases.h"

namespace sunder::chart {
namespace {

constexpr double kSpeed = 1.0;  // m/s

Material ductile() {
    Material material;
    material.youngs_modulus = 2e6;
    material.yield = 0.05;
    material.flow_rate = 5;
    material.toughness = 0.15;
    return material;
}

// Time of the first break, s; NaN when there is none in `seconds`.
double first_break(MovedBar& io_bar, double seconds, bool to_the_end) {
    double found = std::numeric_limits<double>::quiet_NaN();
    const int frames = static_cast<int>(std::lround(24 * seconds));
    for (int f = 0; f < frames; ++f) {
        const Pose begin{Vec3(0, 0, kSpeed * f / 24), Quat::Identity()},
            end{Vec3(0, 0, kSpeed * (f + 1) / 24), Quat::Identity()};
        if (!io_bar.frame(1.0 / 24, begin, end, true)) return std::numeric_limits<double>::quiet_NaN();
        if (std::isnan(found) && !io_bar.state.broken.empty()) found = io_bar.state.broken.front().time;
        if (!std::isnan(found) && !to_the_end) break;
    }
    return found;
}

double limit(int cells) {
    static std::map<int, double> limits;
    if (const auto known = limits.find(cells); known != limits.end()) return known->second;
    MovedBar bar({Mover::projective, cells, 320, 3}, ductile());
    return limits[cells] = first_break(bar, 1, false);
}

}  // namespace

Outcome tear_time(const Setting& setting) {
    MovedBar bar(setting, ductile());
    const double found = first_break(bar, 0.25, true);
    return outcome(bar, found, limit(setting.cells));
}

}  // namespace sunder::chart
