#include "solver/collision/ellipsoid_distance.h"

#include <algorithm>

#include "solver/collision/ascent_kernels.h"
#include "solver/collision/support_ascent.h"
#include "solver/lanes/instruction_set.h"

namespace sunder {
namespace {

/// Numbers compared in stored order: centres decide, unless they coincide.
bool precedes(const Ellipsoid& a, const Ellipsoid& b) {
    for (int i = 0; i < 3; ++i)
        if (a.center[i] != b.center[i]) return a.center[i] < b.center[i];
    for (int i = 0; i < 3; ++i)
        if (a.radii[i] != b.radii[i]) return a.radii[i] < b.radii[i];
    for (int i = 0; i < 9; ++i)
        if (a.axes.data()[i] != b.axes.data()[i]) return a.axes.data()[i] < b.axes.data()[i];
    return true;
}

using detail::kShallow;

void put(const Mat3& M, size_t lane, double (&to)[6][4]) {
    const double sym[6] = {M(0, 0), M(1, 1), M(2, 2), M(0, 1), M(0, 2), M(1, 2)};
    for (int i = 0; i < 6; ++i) to[i][lane] = sym[i];
}

void put(const Vec3& v, size_t lane, double (&to)[3][4]) {
    for (int i = 0; i < 3; ++i) to[i][lane] = v[i];
}

Vec3 taken(const double (&from)[3][4], size_t lane) { return {from[0][lane], from[1][lane], from[2][lane]}; }

struct OrderedPair {
    const Ellipsoid *a, *b;
    const Mat3 *M_a, *M_b;  // support matrices, m2
    bool is_flipped;
};

void put(const OrderedPair& p, size_t lane, FourEllipsoidPairs& to) {
    put(Vec3(p.a->center - p.b->center), lane, to.d);
    put(*p.M_a, lane, to.M_a);
    put(*p.M_b, lane, to.M_b);
}

void put_candidates(const OrderedPair& p, size_t lane, FourEllipsoidPairs& to) {
    for (int i = 0; i < 3; ++i)
        put(p.a->axes.col(i), lane, to.candidates[i]), put(p.b->axes.col(i), lane, to.candidates[3 + i]);
}

Separation separation(const OrderedPair& p, const FourEllipsoidPairs& from, size_t lane) {
    Separation s;
    s.normal = taken(from.n, lane);
    s.point_a = p.a->center - taken(from.s_a, lane);
    s.point_b = p.b->center + taken(from.s_b, lane);
    s.gap = from.f[lane];
    return p.is_flipped ? flipped(s) : s;
}

const AscentKernels& kernels() { return SUNDER_BEST_KERNELS(kAscentKernels); }

constexpr size_t kBatch = 64;  // pairs

// The least radius of curvature of the surface, m.
double least_curvature_radius(const Ellipsoid& e) {
    const double least = e.radii.minCoeff();
    return least * least / e.radii.maxCoeff();
}

// Whether the maximum that a climb found may be a lower one. Along a great circle f'' = -f - rho, rho being the radius
// of curvature there of both surfaces together, no less than the sum of their least: from a maximum of f >= -rho on, f
// falls all the way to the other side, so that there is no other. Shallow overlaps are not asked (kShallow).
bool may_have_higher(const OrderedPair& p, const FourEllipsoidPairs& climbed, size_t lane) {
    return climbed.depth[lane] >= kShallow &&
           -climbed.f[lane] > least_curvature_radius(*p.a) + least_curvature_radius(*p.b);
}

void distances_of_batch(const AscentKernels& kernels, std::span<const OrderedPair> pairs, Separation* out) {
    FourEllipsoidPairs blocks[kBatch / 4], deep_blocks[kBatch / 4];
    const size_t n_blocks = (pairs.size() + 3) / 4;
    for (size_t k = 0; k < 4 * n_blocks; ++k) put(pairs[std::min(k, pairs.size() - 1)], k % 4, blocks[k / 4]);
    kernels.from_centres(blocks, n_blocks);

    size_t deep[kBatch], n_deep = 0;
    for (size_t k = 0; k < pairs.size(); ++k) {
        const FourEllipsoidPairs& block = blocks[k / 4];
        out[k] = separation(pairs[k], block, k % 4);
        if (may_have_higher(pairs[k], block, k % 4)) deep[n_deep++] = k;
    }
    if (n_deep == 0) return;
    const size_t n_deep_blocks = (n_deep + 3) / 4;
    for (size_t m = 0; m < 4 * n_deep_blocks; ++m) {
        const size_t k = deep[std::min(m, n_deep - 1)];
        FourEllipsoidPairs &to = deep_blocks[m / 4], &from = blocks[k / 4];
        put(pairs[k], m % 4, to);
        put_candidates(pairs[k], m % 4, to);
        put(taken(from.n, k % 4), m % 4, to.n);
        put(taken(from.s_a, k % 4), m % 4, to.s_a);
        put(taken(from.s_b, k % 4), m % 4, to.s_b);
        to.f[m % 4] = from.f[k % 4];
    }
    kernels.from_candidates(deep_blocks, n_deep_blocks);
    for (size_t m = 0; m < n_deep; ++m) out[deep[m]] = separation(pairs[deep[m]], deep_blocks[m / 4], m % 4);
}

OrderedPair ordered(const Ellipsoid& a, const Ellipsoid& b, const Mat3& M_a, const Mat3& M_b) {
    return precedes(a, b) ? OrderedPair{&a, &b, &M_a, &M_b, false} : OrderedPair{&b, &a, &M_b, &M_a, true};
}

}  // namespace

Separation ellipsoid_distance(const Ellipsoid& a, const Ellipsoid& b) {
    const Mat3 M_a = detail::support_matrix(a.axes, a.radii), M_b = detail::support_matrix(b.axes, b.radii);
    const OrderedPair pair = ordered(a, b, M_a, M_b);
    Separation s;
    distances_of_batch(kernels(), {&pair, 1}, &s);
    return s;
}

void ellipsoid_distances(std::span<const Ellipsoid> ellipsoids, std::span<const Mat3> support,
                         std::span<const std::pair<uint32_t, uint32_t>> pairs, std::span<Separation> out) {
    const AscentKernels& best = kernels();
    OrderedPair batch[kBatch];
    Mat3 own[2 * kBatch];
    const auto matrix = [&](uint32_t i, Mat3& o_own) -> const Mat3& {
        return support.empty() ? o_own = detail::support_matrix(ellipsoids[i].axes, ellipsoids[i].radii) : support[i];
    };
    for (size_t first = 0; first < pairs.size(); first += kBatch) {
        const size_t n = std::min(kBatch, pairs.size() - first);
        for (size_t k = 0; k < n; ++k) {
            const auto [i, j] = pairs[first + k];
            batch[k] = ordered(ellipsoids[i], ellipsoids[j], matrix(i, own[2 * k]), matrix(j, own[2 * k + 1]));
        }
        distances_of_batch(best, {batch, n}, out.data() + first);
    }
}

}  // namespace sunder
