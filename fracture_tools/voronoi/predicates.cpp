#include "fracture_tools/voronoi/predicates.h"

#include <gmpxx.h>

#include <Eigen/LU>
#include <algorithm>

namespace sunder {
namespace {

using Rational = mpq_class;
using Rational3 = std::array<Rational, 3>;

/// Results in doubles are taken from rational arithmetic where the filter allows them to be farther off than this.
constexpr double kWeightError = 1e-13;

Rational3 exact(const Vec3& p) { return {Rational(p.x()), Rational(p.y()), Rational(p.z())}; }

Rational3 operator-(const Rational3& a, const Rational3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Rational3 operator+(const Rational3& a, const Rational3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

Rational dot(const Rational3& a, const Rational3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Rational3 cross(const Rational3& a, const Rational3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// h(p) = |p - other|^2 - |p - cell|^2 = (cell - other) . (2 p - cell - other).
Rational exact_bisector(const Rational3& p, const Rational3& cell, const Rational3& other) {
    return dot(cell - other, p + p - cell - other);
}

Rational3 exact_trace(const Corners& corners, const Vec3& cell, const Vec3& other) {
    Rational3 h;
    for (int m = 0; m < 3; ++m) h[m] = exact_bisector(exact(corners[m]), exact(cell), exact(other));
    return h;
}

Rational3 exact_functional(const Corners& corners, std::span<const Vec3> sites, uint32_t cell, LineLabel line) {
    if (!is_triangle_edge(line)) return exact_trace(corners, sites[cell], sites[line]);
    Rational3 e = {0, 0, 0};
    e[line - kTriangleEdge] = 1;
    return e;
}

Bounded exact_value(double x) { return {x, 0}; }

Bounded squared_distance(const Vec3& p, const Vec3& site) {
    // Three differences, squares and two sums: relative error 5 u at most.
    const double d = (p - site).squaredNorm();
    return {d, 6 * bounded_detail::kUnit * d + bounded_detail::kUnderflow};
}

Bounded3 difference(const Vec3& a, const Vec3& b) {
    return {exact_value(a.x()) - exact_value(b.x()), exact_value(a.y()) - exact_value(b.y()),
            exact_value(a.z()) - exact_value(b.z())};
}

Bounded3 direction_of(const std::array<Vec3, 3>& sites) {
    return cross(difference(sites[1], sites[0]), difference(sites[2], sites[0]));
}

/// h(p) = (cell - other) . ((p - cell) + (p - other)): for sites close to one another far better than a difference of
/// squared distances, at twice the cost.
Bounded close_bisector(const Vec3& p, const Vec3& cell, const Vec3& other) {
    const Bounded3 a = difference(p, cell), b = difference(p, other);
    return dot(difference(cell, other), Bounded3{a[0] + b[0], a[1] + b[1], a[2] + b[2]});
}

Bounded3 close_trace(const Corners& corners, const Vec3& cell, const Vec3& other) {
    return {close_bisector(corners[0], cell, other), close_bisector(corners[1], cell, other),
            close_bisector(corners[2], cell, other)};
}

/// Unnormalised weights of the point equally far from three sites, of either sign.
Bounded3 meet(const Corners& corners, const std::array<Vec3, 3>& sites) {
    return cross(close_trace(corners, sites[0], sites[1]), close_trace(corners, sites[0], sites[2]));
}

Rational3 exact_meet(const Corners& corners, const std::array<Vec3, 3>& sites) {
    return cross(exact_trace(corners, sites[0], sites[1]), exact_trace(corners, sites[0], sites[2]));
}

Rational exact_parameter(const Corners& corners, const std::array<Vec3, 3>& sites) {
    const Rational3 w = exact_meet(corners, sites), s0 = exact(sites[0]);
    const Rational3 d = cross(exact(sites[1]) - s0, exact(sites[2]) - s0);
    return (w[0] * dot(exact(corners[0]), d) + w[1] * dot(exact(corners[1]), d) + w[2] * dot(exact(corners[2]), d)) /
           (w[0] + w[1] + w[2]);
}

int counted_sign(int sign, PredicateCount& io_count) {
    ++io_count.exact;
    io_count.zeros += sign == 0;
    return sign;
}

}  // namespace

Bounded3 squared_distances(const Corners& corners, const Vec3& site) {
    return {squared_distance(corners[0], site), squared_distance(corners[1], site), squared_distance(corners[2], site)};
}

Bounded3 edge_functional(int k) {
    Bounded3 e;
    e[k].value = 1;
    return e;
}

int nearer_site(const Vec3& p, const Vec3& cell, const Vec3& other, PredicateCount& io_count) {
    const Bounded h = squared_distance(p, other) - squared_distance(p, cell);
    if (h.has_sign()) return h.is_positive() ? 1 : -1;
    return counted_sign(sgn(exact_bisector(exact(p), exact(cell), exact(other))), io_count);
}

int exact_side(const Corners& corners, std::span<const Vec3> sites, uint32_t cell, LineLabel first, LineLabel second,
               uint32_t other) {
    const Rational3 w =
        cross(exact_functional(corners, sites, cell, first), exact_functional(corners, sites, cell, second));
    return sgn(dot(w, exact_functional(corners, sites, cell, other)));
}

double bisector_share(const Vec3& a, const Vec3& b, const Vec3& s_i, const Vec3& s_j, PredicateCount& io_count) {
    const Bounded at_a = close_bisector(a, s_i, s_j), at_b = close_bisector(b, s_i, s_j);
    const Bounded share = at_a / (at_a - at_b);
    if (share.error <= kWeightError) return std::clamp(share.value, 0.0, 1.0);
    ++io_count.exact;
    const Rational h_a = exact_bisector(exact(a), exact(s_i), exact(s_j)),
                   h_b = exact_bisector(exact(b), exact(s_i), exact(s_j));
    return Rational(h_a / (h_a - h_b)).get_d();
}

Vec3 equidistant_weights(const Corners& corners, const std::array<Vec3, 3>& sites, PredicateCount& io_count) {
    const Bounded3 w = meet(corners, sites);
    const Bounded sum = w[0] + w[1] + w[2];
    const Bounded3 share = {w[0] / sum, w[1] / sum, w[2] / sum};
    if (std::max({share[0].error, share[1].error, share[2].error}) <= kWeightError)
        return Vec3(share[0].value, share[1].value, share[2].value).cwiseMax(0).cwiseMin(1);
    ++io_count.exact;
    const Rational3 exact_w = exact_meet(corners, sites);
    const Rational exact_sum = exact_w[0] + exact_w[1] + exact_w[2];
    Vec3 weights;
    for (int m = 0; m < 3; ++m) weights[m] = Rational(exact_w[m] / exact_sum).get_d();
    return weights;
}

Vec3 circumcenter(const std::array<Vec3, 4>& sites, PredicateCount& io_count) {
    // (s_k - s_0) . x = |s_k - s_0|^2 / 2 for x from s_0, by Cramer's rule.
    const Bounded3 a = difference(sites[1], sites[0]), b = difference(sites[2], sites[0]),
                   c = difference(sites[3], sites[0]);
    const Bounded aa = dot(a, a), bb = dot(b, b), cc = dot(c, c);
    const Bounded3 bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
    const Bounded twice = exact_value(2) * dot(a, bc);
    Bounded3 x;
    for (int m = 0; m < 3; ++m) x[m] = (aa * bc[m] + bb * ca[m] + cc * ab[m]) / twice;
    if (std::max({x[0].error, x[1].error, x[2].error}) <= kWeightError)
        return sites[0] + Vec3(x[0].value, x[1].value, x[2].value);
    ++io_count.exact;
    const Rational3 s0 = exact(sites[0]);
    const Rational3 p = exact(sites[1]) - s0, q = exact(sites[2]) - s0, r = exact(sites[3]) - s0;
    const Rational3 qr = cross(q, r), rp = cross(r, p), pq = cross(p, q);
    const Rational pp = dot(p, p), qq = dot(q, q), rr = dot(r, r), exact_twice = 2 * dot(p, qr);
    Vec3 center;
    for (int m = 0; m < 3; ++m)
        center[m] = Rational(s0[m] + (pp * qr[m] + qq * rp[m] + rr * pq[m]) / exact_twice).get_d();
    return center;
}

LineCrossing cross_line(const Corners& corners, const std::array<Vec3, 3>& sites) {
    const Bounded3 w = meet(corners, sites), d = direction_of(sites);
    Bounded sum;
    for (int m = 0; m < 3; ++m) {
        const Bounded3 v = {exact_value(corners[m].x()), exact_value(corners[m].y()), exact_value(corners[m].z())};
        sum = sum + w[m] * dot(v, d);
    }
    return {corners, sum / (w[0] + w[1] + w[2])};
}

int order_along_line(const LineCrossing& x, const LineCrossing& y, const std::array<Vec3, 3>& sites,
                     PredicateCount& io_count) {
    const Bounded gap = y.parameter - x.parameter;
    if (gap.has_sign()) return gap.is_positive() ? 1 : -1;
    ++io_count.exact;
    return sgn(Rational(exact_parameter(y.corners, sites) - exact_parameter(x.corners, sites)));
}

}  // namespace sunder
