// The filter never lies, and the rational path behind it is right: it is driven here on purpose, since in cuts it
// hardly ever runs.
#include "fracture_tools/voronoi/predicates.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

namespace sunder {
namespace {

using Rational = mpq_class;
using Point = std::array<Rational, 3>;

Point exact(const Vec3& p) { return {p.x(), p.y(), p.z()}; }
Rational dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Rational squared_distance(const Point& a, const Point& b) {
    Rational sum = 0;
    for (int m = 0; m < 3; ++m) sum += (a[m] - b[m]) * (a[m] - b[m]);
    return sum;
}

/// The x with n_k . x = c_k, by Cramer's rule.
Point meet(const std::array<Point, 3>& n, const std::array<Rational, 3>& c) {
    auto det = [](const Point& u, const Point& v, const Point& w) -> Rational {
        return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
               u[2] * (v[0] * w[1] - v[1] * w[0]);
    };
    const Rational all = det(n[0], n[1], n[2]);
    Point x;
    for (int m = 0; m < 3; ++m) {
        std::array<Point, 3> k = n;
        for (int r = 0; r < 3; ++r) k[r][m] = c[r];
        x[m] = det(k[0], k[1], k[2]) / all;
    }
    return x;
}

/// Plane of points equally far from two sites, n . x = c.
std::pair<Point, Rational> bisector(const Vec3& i, const Vec3& j) {
    const Point p = exact(i), q = exact(j);
    Point n;
    for (int m = 0; m < 3; ++m) n[m] = 2 * (p[m] - q[m]);
    return {n, dot(p, p) - dot(q, q)};
}
std::pair<Point, Rational> plane_of(const Corners& t) {
    const Point a = exact(t[0]), b = exact(t[1]), c = exact(t[2]);
    Point u, v;
    for (int m = 0; m < 3; ++m) u[m] = b[m] - a[m], v[m] = c[m] - a[m];
    const Point n = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    return {n, dot(n, a)};
}

class Numbers {
public:
    explicit Numbers(uint32_t seed) : engine_(seed) {}
    double share() { return double(engine_()) / 4294967296.0; }
    Vec3 point() { return {share(), share(), share()}; }
    /// On a coarse grid: coincidences by the dozen.
    Vec3 grid_point() { return Vec3(engine_() % 5, engine_() % 5, engine_() % 5) / 4; }
    /// Moved by at most one unit in the last place.
    Vec3 nudged(Vec3 p) {
        for (int m = 0; m < 3; ++m) {
            const int way = int(engine_() % 3) - 1;
            if (way) p[m] = std::nextafter(p[m], way * 10.0);
        }
        return p;
    }

private:
    std::mt19937 engine_;
};

TEST(Bounded, encloses_the_exact_result) {
    Numbers numbers(1);
    for (int k = 0; k < 2000; ++k) {
        Bounded sum{numbers.share(), 0}, product = sum;
        Rational exact_sum = sum.value, exact_product = exact_sum;
        for (int n = 0; n < 12; ++n) {
            const double x = std::ldexp(numbers.share() - 0.5, int(numbers.share() * 9) - 4);
            if (x == 0) continue;
            sum = sum * product - Bounded{x, 0}, exact_sum = exact_sum * exact_product - Rational(x);
            product = product / Bounded{x, 0} + Bounded{0.5, 0},
            exact_product = exact_product / Rational(x) + Rational(0.5);
        }
        EXPECT_LE(abs(Rational(sum.value) - exact_sum), Rational(sum.error));
        EXPECT_LE(abs(Rational(product.value) - exact_product), Rational(product.error));
        EXPECT_LT(product.error, 1e-9 * std::abs(product.value) + 1e-6) << "a bound that bounds nothing is no use";
    }
}

TEST(Predicates, a_point_between_two_sites_is_nearer_to_neither_and_one_bit_away_to_one) {
    const Vec3 i(0, 0, 0), j(1, 0, 0);
    for (double y : {0.0, 0.1, 1 / 3.0, 7.7}) {
        PredicateCount count;
        EXPECT_EQ(nearer_site(Vec3(0.5, y, -y), i, j, count), 0);
        EXPECT_EQ(count.zeros, 1u);
        EXPECT_EQ(nearer_site(Vec3(std::nextafter(0.5, 0), y, -y), i, j, count), 1);
        EXPECT_EQ(nearer_site(Vec3(std::nextafter(0.5, 1), y, -y), i, j, count), -1);
        EXPECT_EQ(count.zeros, 1u);
        if (y > 1) {
            EXPECT_EQ(count.exact, 3u) << "the filter cannot have told these apart";
        }
        EXPECT_EQ(nearer_site(Vec3(0.4, y, -y), i, j, count), 1);
    }
}

/// All kinds of symbolic points of a triangle against a point computed from planes; grids make zeros and near misses.
TEST(Predicates, sides_of_symbolic_points_agree_with_points_made_from_planes) {
    Numbers numbers(2);
    size_t n_exact = 0, n_zeros = 0, n_checked = 0;
    for (int k = 0; k < 4000; ++k) {
        const bool on_grid = k % 2 == 0;
        const bool is_nudged = k % 4 == 0;
        auto point = [&]() -> Vec3 {
            if (!on_grid) return numbers.point();
            return is_nudged ? numbers.nudged(numbers.grid_point()) : numbers.grid_point();
        };
        const Corners t = {point(), point(), point()};
        const std::vector<Vec3> sites = {point(), point(), point(), point()};
        const auto [triangle_normal, triangle_height] = plane_of(t);
        const auto [n1, c1] = bisector(sites[0], sites[1]);
        const auto [n2, c2] = bisector(sites[0], sites[2]);
        // Two bisectors in the triangle's plane, taken in the order in which their weights are positive.
        Point pair_normal = {n1[1] * n2[2] - n1[2] * n2[1], n1[2] * n2[0] - n1[0] * n2[2],
                             n1[0] * n2[1] - n1[1] * n2[0]};
        const Rational turn = dot(pair_normal, triangle_normal);
        if (turn == 0) continue;
        const Point p = meet({triangle_normal, n1, n2}, {triangle_height, c1, c2});
        const int expected = sgn(squared_distance(p, exact(sites[3])) - squared_distance(p, exact(sites[0])));
        const auto [first, second] = turn > 0 ? std::pair(1u, 2u) : std::pair(2u, 1u);
        EXPECT_EQ(exact_side(t, sites, 0, first, second, 3), expected);

        auto functional = [&](uint32_t j) {
            const Bounded3 g = squared_distances(t, sites[j]), h = squared_distances(t, sites[0]);
            return Bounded3{g[0] - h[0], g[1] - h[1], g[2] - h[2]};
        };
        const Bounded side = dot(cross(functional(first), functional(second)), functional(3));
        ++n_checked, n_zeros += expected == 0, n_exact += !side.has_sign();
        if (side.has_sign()) {
            EXPECT_EQ(side.is_positive() ? 1 : -1, expected) << "the filter lied";
        }
        // Edges of the triangle are lines, too: a corner is where two of them meet.
        const int at_corner =
            sgn(squared_distance(exact(t[0]), exact(sites[3])) - squared_distance(exact(t[0]), exact(sites[0])));
        EXPECT_EQ(exact_side(t, sites, 0, kTriangleEdge + 1, kTriangleEdge + 2, 3), at_corner);
    }
    EXPECT_GT(n_checked, 2500u);
    EXPECT_GT(n_exact, 100u) << "the rational path was hardly driven";
    EXPECT_GT(n_zeros, 10u);
}

TEST(Predicates, shares_of_edges_are_good_even_where_the_edge_lies_nearly_in_the_bisector) {
    Numbers numbers(3);
    PredicateCount count;
    for (int k = 0; k < 500; ++k) {
        const Vec3 i = numbers.point(), j = numbers.point(), middle = 0.5 * (i + j), n = (j - i).normalized();
        const Vec3 along = n.cross(numbers.point()).normalized();
        const double lean = std::ldexp(1.0, -int(numbers.share() * 45));
        const Vec3 a = middle + numbers.share() * along - lean * n, b = middle - along + lean * numbers.share() * n;
        const auto [normal, height] = bisector(i, j);
        const Rational at_a = dot(normal, exact(a)) - height, at_b = dot(normal, exact(b)) - height;
        if (sgn(at_a) * sgn(at_b) >= 0) continue;
        const double share = bisector_share(a, b, i, j, count);
        EXPECT_NEAR(share, Rational(at_a / (at_a - at_b)).get_d(), 1e-13) << "lean " << lean;
    }
    EXPECT_GT(count.exact, 20u);
}

TEST(Predicates, weights_and_circumcenters_are_good_in_bad_positions) {
    Numbers numbers(4);
    PredicateCount flat_count, lean_count;
    for (int k = 0; k < 500; ++k) {
        // Four sites nearly in one circle: the centre is far from well determined in doubles.
        const double height = std::ldexp(1.0, -int(numbers.share() * 40));
        std::array<Vec3, 4> sites;
        for (int m = 0; m < 4; ++m) {
            const double angle = numbers.share() * 6.2;
            sites[m] = Vec3(0.5 * std::cos(angle), 0.5 * std::sin(angle), m == 3 ? height : 0);
        }
        if ((sites[1] - sites[0]).cross(sites[2] - sites[0]).norm() < 1e-3) continue;
        const auto [n1, c1] = bisector(sites[0], sites[1]);
        const auto [n2, c2] = bisector(sites[0], sites[2]);
        const auto [n3, c3] = bisector(sites[0], sites[3]);
        const Point truth = meet({n1, n2, n3}, {c1, c2, c3});
        const Vec3 center = circumcenter(sites, flat_count);
        const Vec3 expected(truth[0].get_d(), truth[1].get_d(), truth[2].get_d());
        EXPECT_LT((center - expected).norm(), 2e-13 * std::max(1.0, expected.norm()));

        // A triangle nearly parallel to the line equally far from three sites (the z axis).
        const Corners t = {Vec3(-1, -1, -1), Vec3(1, -1, -1), Vec3(-1, 1, 1 / height)};
        const std::array<Vec3, 3> three = {sites[0], sites[1], sites[2]};
        const Vec3 w = equidistant_weights(t, three, lean_count);
        EXPECT_NEAR(w.sum(), 1, 1e-12);
        const auto [nt, ct] = plane_of(t);
        const Point p = meet({nt, n1, n2}, {ct, c1, c2});
        // x and y of the point are those of the weights, up to the triangle's size.
        EXPECT_NEAR(w[1], Rational((p[0] + 1) / 2).get_d(), 1e-12);
        EXPECT_NEAR(w[2], Rational((p[1] + 1) / 2).get_d(), 1e-12);
    }
    EXPECT_GT(flat_count.exact, 50u);
}

TEST(Predicates, crossings_of_a_line_are_in_order_to_the_last_bit) {
    const std::array<Vec3, 3> sites = {Vec3(0.1, 0.2, 0), Vec3(0.9, 0.15, 0), Vec3(0.4, 0.85, 0)};  // line along z
    auto triangle_at = [&](double z) { return Corners{Vec3(-3, -3, z), Vec3(5, -3, z), Vec3(-3, 5, z)}; };
    PredicateCount count;
    for (double z : {0.1, 1 / 3.0, 0.7}) {
        const LineCrossing low = cross_line(triangle_at(z), sites),
                           high = cross_line(triangle_at(std::nextafter(z, 1)), sites);
        EXPECT_EQ(order_along_line(low, high, sites, count), 1);
        EXPECT_EQ(order_along_line(high, low, sites, count), -1);
        EXPECT_EQ(count.zeros, 0u);
    }
    EXPECT_EQ(count.exact, 6u);
    const LineCrossing there = cross_line(triangle_at(0.3), sites), far = cross_line(triangle_at(0.8), sites);
    EXPECT_EQ(order_along_line(there, far, sites, count), 1);
    EXPECT_EQ(count.exact, 6u);
    EXPECT_EQ(order_along_line(there, there, sites, count), 0);
}

}  // namespace
}  // namespace sunder
