#include "solver/collision/hull_support.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "solver/collision/ellipsoid_distance.h"

namespace sunder {
namespace {

// The farthest that a point of the hull is outside, by the way to the surface along its own direction.
double farthest_outside(const SimulationMesh& rest, uint32_t i, const Mat3& F_P) {
    constexpr double kRounding = 1e-9;  // a share of the way, beyond which a point is surely not the farthest
    // Into the frame in which the ellipsoid is the unit ball.
    const Mat3 to_ball =
        rest.radii[i].cwiseInverse().asDiagonal() * rest.rest_orientation[i].conjugate().toRotationMatrix() * F_P;
    double farthest = 0;
    for (const Vec3f& point : rest.hull(i)) {
        const Vec3 x = point.cast<double>(), p = F_P * x;
        const double length = p.norm();
        if (length * (1 + kRounding - 1 / (to_ball * x).norm()) < farthest) continue;
        const double times = (rest.rest_orientation[i].conjugate() * p).cwiseQuotient(rest.radii[i]).norm();
        if (times > 1) farthest = std::max(farthest, length * (1 - 1 / times));
    }
    return farthest;
}

// The farthest of the points (one or more) along `direction`, four at a time: the same bits as one by one.
float farthest_along(const Vec3f& direction, std::span<const Vec3f> points) {
    using Four = float __attribute__((vector_size(16)));
    constexpr size_t kTogether = 4;
    const float *const at = points.front().data(), x = direction.x(), y = direction.y(), z = direction.z();
    const auto along = [&](const float* p) { return x * p[0] + (y * p[1] + z * p[2]); };
    const size_t n = points.size();
    if (n < kTogether) {
        float farthest = along(at);
        for (size_t k = 1; k < n; ++k) farthest = std::max(farthest, along(at + 3 * k));
        return farthest;
    }
    //  x0 y0 z0 x1 | y1 z1 x2 y2 | z2 x3 y3 z3
    const auto four_along = [&](const float* p) {
        Four a, b, c;
        std::memcpy(&a, p, sizeof(a)), std::memcpy(&b, p + 4, sizeof(b)), std::memcpy(&c, p + 8, sizeof(c));
        const Four b2c1 = __builtin_shufflevector(b, c, 2, 3, 5, 6);  // x2 y2 x3 y3
        const Four a1b0 = __builtin_shufflevector(a, b, 1, 2, 4, 5);  // y0 z0 y1 z1
        const Four X = __builtin_shufflevector(a, b2c1, 0, 3, 4, 6),
                   Y = __builtin_shufflevector(a1b0, b2c1, 0, 2, 5, 7);
        const Four Z = __builtin_shufflevector(a1b0, c, 1, 3, 4, 7);
        return x * X + (y * Y + z * Z);
    };
    Four farthest = four_along(at);
    for (size_t k = kTogether; k < n; k += kTogether) {
        const Four next = four_along(at + 3 * std::min(k, n - kTogether));  // some of the last ones twice
        farthest = next > farthest ? next : farthest;
    }
    return std::max(std::max(farthest[0], farthest[1]), std::max(farthest[2], farthest[3]));
}

}  // namespace

double standing_out(const SimulationMesh& rest, uint32_t i, const Mat3& F_P, const Vec3& direction) {
    const std::span<const Vec3f> hull = rest.hull(i);
    if (hull.empty()) return 0;
    const Vec3f along = (F_P.transpose() * direction).cast<float>();
    return rest.radii[i].cwiseProduct(rest.rest_orientation[i].conjugate() * direction).norm() -
           farthest_along(along, hull);
}

void rest_gaps(const SimulationMesh& rest, std::span<const std::pair<uint32_t, uint32_t>> pairs, double* out) {
    constexpr size_t kTogether = 32;
    std::array<Ellipsoid, 2 * kTogether> solids;
    std::array<std::pair<uint32_t, uint32_t>, kTogether> local;
    std::array<Separation, kTogether> apart;
    const auto at_rest = [&](uint32_t k) {
        return Ellipsoid{rest.rest_position[k], rest.rest_orientation[k].toRotationMatrix(), rest.radii[k]};
    };
    for (size_t first = 0; first < pairs.size(); first += kTogether) {
        const size_t n = std::min(kTogether, pairs.size() - first);
        for (uint32_t k = 0; k < n; ++k) {
            solids[2 * k] = at_rest(pairs[first + k].first), solids[2 * k + 1] = at_rest(pairs[first + k].second);
            local[k] = {2 * k, 2 * k + 1};
        }
        ellipsoid_distances(solids, {}, std::span(local).first(n), apart);
        for (size_t k = 0; k < n; ++k) out[first + k] = apart[k].gap;
    }
}

void HullReach::renumber(std::span<const uint32_t> former) {
    const std::vector<uint64_t> found_for = std::move(found_for_);
    const std::vector<double> reach = std::move(reach_);
    found_for_.assign(former.size(), 0), reach_.resize(former.size());
    for (size_t i = 0; i < former.size(); ++i) {
        if (former[i] >= found_for.size()) continue;
        found_for_[i] = found_for[former[i]], reach_[i] = reach[former[i]];
    }
}

void HullReach::update(const SimulationMesh& rest, std::span<const Mat3> F_P, const WorkerPool& workers) {
    constexpr size_t kGrain = 256;
    if (found_for_.size() != F_P.size()) {
        found_for_.assign(F_P.size(), 0);
        reach_.resize(F_P.size());
    }
    workers.for_range(F_P.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const uint64_t key = plastic_key(F_P[i]);
            if (found_for_[i] == key) continue;
            found_for_[i] = key;
            reach_[i] = farthest_outside(rest, static_cast<uint32_t>(i), F_P[i]);
        }
    });
}

}  // namespace sunder
