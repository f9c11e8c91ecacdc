#include "solver/collision/ellipsoid_distance.h"

#include <algorithm>

#include "solver/collision/ascent_kernels.h"
#include "solver/collision/support_ascent.h"
#include "solver/lanes/instruction_set.h"

namespace sunder {
namespace {

// Where ellipsoids come from: `of.center[i]`, `of.radii[i]`, `of.axes(i)`.
struct TwoEllipsoids {
    TwoEllipsoids(const Ellipsoid& a, const Ellipsoid& b)
        : center{a.center, b.center}, radii{a.radii, b.radii}, of{&a, &b} {}
    const Mat3& axes(size_t i) const { return of[i]->axes; }
    Vec3 center[2], radii[2];
    const Ellipsoid* of[2];
};

/// Numbers compared in stored order: centres decide, unless they coincide.
template <class Ellipsoids>
bool precedes(const Ellipsoids& of, uint32_t a, uint32_t b) {
    for (int i = 0; i < 3; ++i)
        if (of.center[a][i] != of.center[b][i]) return of.center[a][i] < of.center[b][i];
    for (int i = 0; i < 3; ++i)
        if (of.radii[a][i] != of.radii[b][i]) return of.radii[a][i] < of.radii[b][i];
    const Mat3 axes_a = of.axes(a), axes_b = of.axes(b);
    for (int i = 0; i < 9; ++i)
        if (axes_a.data()[i] != axes_b.data()[i]) return axes_a.data()[i] < axes_b.data()[i];
    return true;
}

using detail::kShallow;

void put(const Sym3& M, size_t lane, double (&to)[6][4]) {
    for (int i = 0; i < 6; ++i) to[i][lane] = M[i];
}

void put(const Vec3& v, size_t lane, double (&to)[3][4]) {
    for (int i = 0; i < 3; ++i) to[i][lane] = v[i];
}

Vec3 taken(const double (&from)[3][4], size_t lane) { return {from[0][lane], from[1][lane], from[2][lane]}; }

struct OrderedPair {
    uint32_t a, b;
    const Sym3 *M_a, *M_b;  // support matrices, m2
    bool is_flipped;
};

template <class Ellipsoids>
OrderedPair ordered(const Ellipsoids& of, uint32_t a, uint32_t b, const Sym3& M_a, const Sym3& M_b) {
    return precedes(of, a, b) ? OrderedPair{a, b, &M_a, &M_b, false} : OrderedPair{b, a, &M_b, &M_a, true};
}

template <class Ellipsoids>
void put(const Ellipsoids& of, const OrderedPair& p, size_t lane, FourEllipsoidPairs& to) {
    put(Vec3(of.center[p.a] - of.center[p.b]), lane, to.d);
    put(*p.M_a, lane, to.M_a);
    put(*p.M_b, lane, to.M_b);
}

void put_candidates(const Mat3& axes_a, const Mat3& axes_b, size_t lane, FourEllipsoidPairs& to) {
    for (int i = 0; i < 3; ++i)
        put(Vec3(axes_a.col(i)), lane, to.candidates[i]), put(Vec3(axes_b.col(i)), lane, to.candidates[3 + i]);
}

template <class Ellipsoids>
Separation separation(const Ellipsoids& of, const OrderedPair& p, const FourEllipsoidPairs& from, size_t lane) {
    Separation s;
    s.normal = taken(from.n, lane);
    s.point_a = of.center[p.a] - taken(from.s_a, lane);
    s.point_b = of.center[p.b] + taken(from.s_b, lane);
    s.gap = from.f[lane];
    return p.is_flipped ? flipped(s) : s;
}

const AscentKernels& kernels() { return SUNDER_BEST_KERNELS(kAscentKernels); }

constexpr size_t kBatch = 64;  // pairs

// The least radius of curvature of the surface, m.
double least_curvature_radius(const Vec3& radii) {
    const double least = radii.minCoeff();
    return least * least / radii.maxCoeff();
}

// Whether the maximum that a climb found may be a lower one. Along a great circle f'' = -f - rho, rho being the radius
// of curvature there of both surfaces together, no less than the sum of their least: from a maximum of f >= -rho on, f
// falls all the way to the other side, so that there is no other. Shallow overlaps are not asked (kShallow).
bool may_have_higher(const Vec3& radii_a, const Vec3& radii_b, const FourEllipsoidPairs& climbed, size_t lane) {
    return climbed.depth[lane] >= kShallow &&
           -climbed.f[lane] > least_curvature_radius(radii_a) + least_curvature_radius(radii_b);
}

template <class Ellipsoids>
void distances_of_batch(const AscentKernels& kernels, const Ellipsoids& of, std::span<const OrderedPair> pairs,
                        Separation* out) {
    FourEllipsoidPairs blocks[kBatch / 4], deep_blocks[kBatch / 4];
    const size_t n_blocks = (pairs.size() + 3) / 4;
    for (size_t k = 0; k < 4 * n_blocks; ++k) put(of, pairs[std::min(k, pairs.size() - 1)], k % 4, blocks[k / 4]);
    kernels.from_centres(blocks, n_blocks);

    size_t deep[kBatch], n_deep = 0;
    for (size_t k = 0; k < pairs.size(); ++k) {
        const OrderedPair& p = pairs[k];
        const FourEllipsoidPairs& block = blocks[k / 4];
        out[k] = separation(of, p, block, k % 4);
        if (may_have_higher(of.radii[p.a], of.radii[p.b], block, k % 4)) deep[n_deep++] = k;
    }
    if (n_deep == 0) return;
    const size_t n_deep_blocks = (n_deep + 3) / 4;
    for (size_t m = 0; m < 4 * n_deep_blocks; ++m) {
        const size_t k = deep[std::min(m, n_deep - 1)];
        FourEllipsoidPairs &to = deep_blocks[m / 4], &from = blocks[k / 4];
        put(of, pairs[k], m % 4, to);
        put_candidates(of.axes(pairs[k].a), of.axes(pairs[k].b), m % 4, to);
        put(taken(from.n, k % 4), m % 4, to.n);
        put(taken(from.s_a, k % 4), m % 4, to.s_a);
        put(taken(from.s_b, k % 4), m % 4, to.s_b);
        to.f[m % 4] = from.f[k % 4];
    }
    kernels.from_candidates(deep_blocks, n_deep_blocks);
    for (size_t m = 0; m < n_deep; ++m) out[deep[m]] = separation(of, pairs[deep[m]], deep_blocks[m / 4], m % 4);
}

}  // namespace

Separation ellipsoid_distance(const Ellipsoid& a, const Ellipsoid& b) {
    const Sym3 M_a = to_sym(detail::support_matrix(a.axes, a.radii)),
               M_b = to_sym(detail::support_matrix(b.axes, b.radii));
    const TwoEllipsoids two(a, b);
    const OrderedPair pair = ordered(two, 0, 1, M_a, M_b);
    Separation s;
    distances_of_batch(kernels(), two, {&pair, 1}, &s);
    return s;
}

void ellipsoid_distances(const ParticleEllipsoids& ellipsoids, std::span<const Sym3> support,
                         std::span<const std::pair<uint32_t, uint32_t>> pairs, std::span<Separation> out) {
    const AscentKernels& best = kernels();
    OrderedPair batch[kBatch];
    Sym3 own[2 * kBatch];
    const auto matrix = [&](uint32_t i, Sym3& o_own) -> const Sym3& {
        return support.empty() ? o_own = to_sym(detail::support_matrix(ellipsoids.axes(i), ellipsoids.radii[i]))
                               : support[i];
    };
    for (size_t first = 0; first < pairs.size(); first += kBatch) {
        const size_t n = std::min(kBatch, pairs.size() - first);
        for (size_t k = 0; k < n; ++k) {
            const auto [i, j] = pairs[first + k];
            batch[k] = ordered(ellipsoids, i, j, matrix(i, own[2 * k]), matrix(j, own[2 * k + 1]));
        }
        distances_of_batch(best, ellipsoids, {batch, n}, out.data() + first);
    }
}

}  // namespace sunder
