// Where points of a mesh lie among Voronoi cells, without error: a filter first, rational numbers where it cannot tell.
//
// Points are symbolic (Lévy & Liu 2010): a corner of a triangle, an edge of it cut by one bisector plane, or its plane
// cut by two. In barycentric coordinates of the triangle all of them are the meet of two lines; a line is a functional
//
//     H = (h(a), h(b), h(c)),   h(v) = |v - s_other|^2 - |v - s_cell|^2  > 0 nearer to `cell`     (trace of a bisector)
//     H = unit vector e_k                                                                        (edge opposite corner
//     k)
//
// and the point where lines 1 and 2 meet has the weights W = H_1 x H_2 up to a factor, positive when line 2 follows
// line 1 counter-clockwise around a polygon. The side of a third line it lies on is the sign of W . H_3.
// No triangle is degenerate in its own barycentric coordinates, also if its area is zero.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "fracture_tools/voronoi/bounded.h"
#include "solver/data/math.h"

namespace sunder {

/// How often the filter could not tell, and how often the answer was an exact zero: a degenerate position, in which
/// symbolic points have no single name. Cutters then jitter the sites.
struct PredicateCount {
    size_t exact = 0, zeros = 0;

    PredicateCount& operator+=(const PredicateCount& other) {
        exact += other.exact, zeros += other.zeros;
        return *this;
    }
};

/// A line in a triangle: the number of the site behind the bisector, or kTriangleEdge + k.
using LineLabel = uint32_t;
constexpr LineLabel kTriangleEdge = 0xfffffff0u;
inline bool is_triangle_edge(LineLabel line) { return line >= kTriangleEdge; }

using Corners = std::array<Vec3, 3>;

/// |corner - site|^2 of the three corners.
Bounded3 squared_distances(const Corners& corners, const Vec3& site);

/// Functional of an edge of the triangle.
Bounded3 edge_functional(int k);

/// The sign of |p - other|^2 - |p - cell|^2: positive nearer to `cell`.
int nearer_site(const Vec3& p, const Vec3& cell, const Vec3& other, PredicateCount& io_count);

/// On which side of the bisector with `other` lines `first` and `second` of `cell` meet: 1 nearer to `cell`. Rational
/// arithmetic alone, for when the filter on W . H cannot tell.
int exact_side(const Corners& corners, std::span<const Vec3> sites, uint32_t cell, LineLabel first, LineLabel second,
               uint32_t other);

/// Share of the way from a to b at which |. - s_i|^2 = |. - s_j|^2; a and b lie on different sides. Good to 1e-13.
double bisector_share(const Vec3& a, const Vec3& b, const Vec3& s_i, const Vec3& s_j, PredicateCount& io_count);

/// Weights of the corners at the point equally far from three sites; sum 1. Good to 1e-13.
Vec3 equidistant_weights(const Corners& corners, const std::array<Vec3, 3>& sites, PredicateCount& io_count);

/// The centre of the sphere through four sites. Good to 1e-13 in a box of size 1.
Vec3 circumcenter(const std::array<Vec3, 4>& sites, PredicateCount& io_count);

/// A point where the line equally far from three sites crosses a triangle.
struct LineCrossing {
    Corners corners;
    Bounded parameter;  // along (s_1 - s_0) x (s_2 - s_0)
};
LineCrossing cross_line(const Corners& corners, const std::array<Vec3, 3>& sites);

/// Sign of y's parameter minus x's: 1 when x comes first. 0 is no degenerate position of the sites but two triangles
/// that touch there.
int order_along_line(const LineCrossing& x, const LineCrossing& y, const std::array<Vec3, 3>& sites,
                     PredicateCount& io_count);

}  // namespace sunder
