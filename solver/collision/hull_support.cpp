#include "solver/collision/hull_support.h"

#include <algorithm>

#include "solver/collision/ellipsoid_distance.h"

namespace sunder {
namespace {

// The farthest that a point of the hull is outside, by the way to the surface along its own direction.
double farthest_outside(const SimulationMesh& rest, uint32_t i, const Mat3& F_P) {
    double farthest = 0;
    for (const Vec3f& point : rest.hull(i)) {
        const Vec3 p = F_P * point.cast<double>();
        const double times = (rest.rest_orientation[i].conjugate() * p).cwiseQuotient(rest.radii[i]).norm();
        if (times > 1) farthest = std::max(farthest, p.norm() * (1 - 1 / times));
    }
    return farthest;
}

}  // namespace

double standing_out(const SimulationMesh& rest, uint32_t i, const Mat3& F_P, const Vec3& direction) {
    const std::span<const Vec3f> hull = rest.hull(i);
    if (hull.empty()) return 0;
    const Vec3f along = (F_P.transpose() * direction).cast<float>();
    float farthest = along.dot(hull.front());
    for (const Vec3f& p : hull) farthest = std::max(farthest, along.dot(p));
    return rest.radii[i].cwiseProduct(rest.rest_orientation[i].conjugate() * direction).norm() - farthest;
}

double rest_gap(const SimulationMesh& rest, uint32_t i, uint32_t j) {
    const auto at_rest = [&](uint32_t k) {
        return Ellipsoid{rest.rest_position[k], rest.rest_orientation[k].toRotationMatrix(), rest.radii[k]};
    };
    return ellipsoid_distance(at_rest(i), at_rest(j)).gap;
}

void HullReach::renumber(std::span<const uint32_t> former) {
    const std::vector<Mat3> found_for = std::move(found_for_);
    const std::vector<double> reach = std::move(reach_);
    found_for_.assign(former.size(), Mat3::Zero()), reach_.resize(former.size());
    for (size_t i = 0; i < former.size(); ++i) {
        if (former[i] >= found_for.size()) continue;
        found_for_[i] = found_for[former[i]], reach_[i] = reach[former[i]];
    }
}

void HullReach::update(const SimulationMesh& rest, std::span<const Mat3> F_P, const WorkerPool& workers) {
    constexpr size_t kGrain = 256;
    if (found_for_.size() != F_P.size()) {
        found_for_.assign(F_P.size(), Mat3::Zero());  // of no particle
        reach_.resize(F_P.size());
    }
    workers.for_range(F_P.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            if (found_for_[i] == F_P[i]) continue;
            found_for_[i] = F_P[i];
            reach_[i] = farthest_outside(rest, static_cast<uint32_t>(i), F_P[i]);
        }
    });
}

}  // namespace sunder
