#include "tests/benchmarks/bench/lying.h"

#include <algorithm>

#include "tests/benchmarks/bench/measure.h"

namespace sunder::bench {

Lying how_things_lie(const Solver& solver, double frame_seconds, std::span<const Vec3> before,
                     std::span<const Vec3> now, std::span<const Quat> orientation) {
    const Scene& scene = solver.scene();
    Lying lies;
    std::vector<double> speeds;
    for (size_t i = 0; i < now.size(); ++i) speeds.push_back((now[i] - before[i]).norm() / frame_seconds);
    lies.speed_p50 = quantile(speeds, 0.5), lies.speed_p90 = quantile(speeds, 0.9);
    if (scene.colliders.empty() || scene.colliders[0].shape.kind != ShapeKind::plane) return lies;
    for (size_t i = 0; i < now.size(); ++i) {
        const Quat turned = orientation[i] * scene.rest.rest_orientation[i].conjugate();
        for (const Vec3f& p : scene.rest.hull(i))
            lies.below_floor = std::max(lies.below_floor, -(now[i] + turned * p.cast<double>()).z());
    }
    return lies;
}

}  // namespace sunder::bench
