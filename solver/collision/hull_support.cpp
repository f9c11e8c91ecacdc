#include "solver/collision/hull_support.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "solver/collision/ellipsoid_distance.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

using Four = float __attribute__((vector_size(16)));
constexpr size_t kTogether = 4;  // points

struct FourPoints {
    Four x, y, z;
};

// x0 y0 z0 x1 | y1 z1 x2 y2 | z2 x3 y3 z3
FourPoints four_points(const float* p) {
    Four a, b, c;
    std::memcpy(&a, p, sizeof(a)), std::memcpy(&b, p + 4, sizeof(b)), std::memcpy(&c, p + 8, sizeof(c));
    const Four b2c1 = __builtin_shufflevector(b, c, 2, 3, 5, 6);  // x2 y2 x3 y3
    const Four a1b0 = __builtin_shufflevector(a, b, 1, 2, 4, 5);  // y0 z0 y1 z1
    return {__builtin_shufflevector(a, b2c1, 0, 3, 4, 6), __builtin_shufflevector(a1b0, b2c1, 0, 2, 5, 7),
            __builtin_shufflevector(a1b0, c, 1, 3, 4, 7)};
}

Four root(Four a) {
    for (size_t i = 0; i < kTogether; ++i) a[i] = __builtin_sqrtf(a[i]);
    return a;
}

// A matrix for each of four points.
struct FourMatrices {
    Four at[3][3];
    explicit FourMatrices(const Eigen::Matrix3f& M) {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) at[i][j] = Four{M(i, j), M(i, j), M(i, j), M(i, j)};
    }
};

// |M p| of each.
Four lengths(const FourMatrices& M, const FourPoints& p) {
    Four square = {};
    for (const auto& row : M.at) {
        const Four along = row[0] * p.x + row[1] * p.y + row[2] * p.z;
        square += along * along;
    }
    return root(square);
}

// The farthest that a point of the hull is outside, by the way to the surface along its own direction: |p| - |p| / t,
// t being how many times as far as the surface it is. First for all in single precision, with an error of a few
// roundings of |F_P| |B| |x|^2 and |F_P| |x| (B: into the ball) where t is 1 or more, then for those that may be it.
double farthest_outside(const SimulationMesh& rest, ParticleIndex i, const Mat3& F_P) {
    constexpr float kError = 4e-6f;  // some sixty roundings, of which sums of three products have ten
    const std::span<const Vec3f> hull = rest.hull(i);
    const auto exactly = [&](const Vec3f& x) {
        const Vec3 p = F_P * x.cast<double>();
        const double times = (rest.rest_orientation[i].conjugate() * p).cwiseQuotient(rest.radii[i]).norm();
        return times > 1 ? p.norm() * (1 - 1 / times) : 0.0;
    };
    double farthest = 0;
    std::array<float, 256> about;
    const size_t n = hull.size();
    if (n < kTogether || n > about.size()) {
        for (const Vec3f& x : hull) farthest = std::max(farthest, exactly(x));
        return farthest;
    }
    const Eigen::Matrix3f F = F_P.cast<float>();
    const Mat3 to_surface =
        rest.radii[i].cwiseInverse().asDiagonal() * rest.rest_orientation[i].conjugate().toRotationMatrix();
    const Eigen::Matrix3f B = (to_surface * F_P).cast<float>();
    const FourMatrices to_world(F), to_ball(B);
    Four most = {}, reach = {};
    for (size_t k = 0; k < n; k += kTogether) {
        const size_t at = std::min(k, n - kTogether);  // some of the last ones twice
        const FourPoints x = four_points(hull[at].data());
        const Four length = lengths(to_world, x), way = length - length / lengths(to_ball, x);
        std::memcpy(&about[at], &way, sizeof(way));
        most = way > most ? way : most;
        const Four square = x.x * x.x + x.y * x.y + x.z * x.z;
        reach = square > reach ? square : reach;
    }
    const auto largest = [](Four v) { return std::max(std::max(v[0], v[1]), std::max(v[2], v[3])); };
    const float square = largest(reach);
    const float error = kError * F.norm() * (B.norm() * square + std::sqrt(square)), least = largest(most) - 2 * error;
    for (size_t k = 0; k < n; ++k)
        if (!(about[k] < least)) farthest = std::max(farthest, exactly(hull[k]));
    return farthest;
}

// The farthest of the points (one or more) along `direction`, four at a time: the same bits as one by one.
float farthest_along(const Vec3f& direction, std::span<const Vec3f> points) {
    const float *const at = points.front().data(), x = direction.x(), y = direction.y(), z = direction.z();
    const auto along = [&](const float* p) { return x * p[0] + (y * p[1] + z * p[2]); };
    const size_t n = points.size();
    if (n < kTogether) {
        float farthest = along(at);
        for (size_t k = 1; k < n; ++k) farthest = std::max(farthest, along(at + 3 * k));
        return farthest;
    }
    const auto four_along = [&](const float* from) {
        const FourPoints p = four_points(from);
        return x * p.x + (y * p.y + z * p.z);
    };
    Four farthest = four_along(at);
    for (size_t k = kTogether; k < n; k += kTogether) {
        const Four next = four_along(at + 3 * std::min(k, n - kTogether));  // some of the last ones twice
        farthest = next > farthest ? next : farthest;
    }
    return std::max(std::max(farthest[0], farthest[1]), std::max(farthest[2], farthest[3]));
}

}  // namespace

double standing_out(const SimulationMesh& rest, ParticleIndex i, const Mat3& F_P, const Vec3& direction) {
    const std::span<const Vec3f> hull = rest.hull(i);
    if (hull.empty()) return 0;
    const Vec3f along = (F_P.transpose() * direction).cast<float>();
    return rest.radii[i].cwiseProduct(rest.rest_orientation[i].conjugate() * direction).norm() -
           farthest_along(along, hull);
}

void rest_gaps(const SimulationMesh& rest, std::span<const std::pair<uint32_t, uint32_t>> pairs, double* out) {
    constexpr size_t kTogether = 32;
    const ParticleEllipsoids at_rest{rest.rest_position, {}, rest.rest_orientation, rest.radii};
    std::array<Separation, kTogether> apart;
    for (size_t first = 0; first < pairs.size(); first += kTogether) {
        const auto some = pairs.subspan(first, std::min(kTogether, pairs.size() - first));
        ellipsoid_distances(at_rest, {}, some, apart);
        for (size_t k = 0; k < some.size(); ++k) out[first + k] = apart[k].gap;
    }
}

void HullReach::renumber(std::span<const ParticleId> former) {
    SUNDER_ASSERT(reach_.size() >= found_for_.size());
    const std::vector<uint64_t> found_for = std::move(found_for_);
    const std::vector<double> reach = std::move(reach_);
    found_for_.assign(former.size(), 0), reach_.resize(former.size());
    for (size_t i = 0; i < former.size(); ++i) {
        if (former[i] >= found_for.size()) continue;
        found_for_[i] = found_for[former[i]], reach_[i] = reach[former[i]];
    }
}

void HullReach::update(const SimulationMesh& rest, std::span<const Mat3> F_P, const WorkerPool& workers) {
    SUNDER_ASSERT(F_P.size() == rest.n_particles() && rest.radii.size() == F_P.size());
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
            reach_[i] = farthest_outside(rest, i, F_P[i]);
        }
    });
}

}  // namespace sunder
