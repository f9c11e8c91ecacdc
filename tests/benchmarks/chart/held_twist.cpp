#include <cmath>
#include <limits>

#include "tests/benchmarks/chart/cases.h"

namespace sunder::chart {
namespace {

// Where the bar took the point that rested at X: the eight particles around it carry it rigidly, weighted trilinearly.
Vec3 carried(const MovedBar& bar, const Vec3& X) {
    const int n = bar.setting.cells;
    const double d = 0.2 / n;
    const Vec3 grid = (X + Vec3(0.1, 0.1, 0)) / d - Vec3::Constant(0.5);
    int low[3];
    double share[3];
    const int count[3] = {n, n, 5 * n};
    for (int i = 0; i < 3; ++i) {
        low[i] = std::clamp(static_cast<int>(std::floor(grid(i))), 0, count[i] - 2);
        share[i] = grid(i) - low[i];
    }
    Vec3 x = Vec3::Zero();
    for (int corner = 0; corner < 8; ++corner) {
        size_t index = 0, stride = 1;
        double weight = 1;
        for (int i = 0; i < 3; ++i) {
            const int up = corner >> i & 1;
            index += stride * static_cast<size_t>(low[i] + up), stride *= static_cast<size_t>(count[i]);
            weight *= up ? share[i] : 1 - share[i];
        }
        const Quat D = bar.state.orientation[index] * bar.rest().rest_orientation[index].conjugate();
        x += weight * (bar.state.position[index] + D * (X - bar.rest().rest_position[index]));
    }
    return x;
}

}  // namespace

Outcome held_twist(const Setting& setting) {
    Material material;
    material.youngs_modulus = 2e6;
    MovedBar bar(setting, material);
    constexpr double kDamping = 6;
    const bool sound =
        bar.turn(0, M_PI / 2, 0.5, kDamping) && bar.turn(M_PI / 2, M_PI / 2, kCases[0].simulated_s - 0.5, kDamping);

    static const auto rows = reference_rows("twist90_neohooke_nu0.00.csv");
    constexpr size_t kSurfaceRows = 425;  // then come the centres of the free cells of the 4 x 4 x 20 bar
    double difference = 0, displacement = 0;
    for (size_t k = kSurfaceRows; k < rows.size(); ++k) {
        const Vec3 X(rows[k][0], rows[k][1], rows[k][2]), x(rows[k][3], rows[k][4], rows[k][5]);
        difference += (carried(bar, X) - x).squaredNorm();
        displacement += (x - X).squaredNorm();
    }
    const double error = sound ? std::sqrt(difference / displacement) : std::numeric_limits<double>::infinity();
    return {error, 0, error, bar.simulated_s, bar.frame_cpu, bar.total_substeps};
}

}  // namespace sunder::chart
