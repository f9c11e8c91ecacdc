#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/benchmarks/chart/cases.h"

namespace sunder::chart {
namespace {

// Where the torque falls to zero as the bar is turned back, degrees.
double reference_residual() {
    const auto rows = reference_rows("reference/twist90_j2_yield0.02.csv");
    for (size_t k = 1; k < rows.size(); ++k)
        if (rows[k][1] <= 0)
            return rows[k - 1][0] + (rows[k][0] - rows[k - 1][0]) * rows[k - 1][1] / (rows[k - 1][1] - rows[k][1]);
    throw std::runtime_error("the reference torque never falls to zero");
}

}  // namespace

Outcome residual_twist(const Setting& setting) {
    static const double reference = reference_residual();
    Material material;
    material.youngs_modulus = 2e6;
    material.yield = 0.02;
    material.flow_rate = 30;
    MovedBar bar(setting, material);
    constexpr double kQuarter = M_PI / 2;
    const bool sound = bar.turn(0, kQuarter, 0.5, 2) && bar.turn(kQuarter, kQuarter, 0.25, 2) && bar.let_go(1, 8);
    return outcome(bar, sound ? bar.twist() * 180 / M_PI : std::numeric_limits<double>::quiet_NaN(), reference);
}

}  // namespace sunder::chart
