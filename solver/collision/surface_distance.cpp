#include "solver/collision/surface_distance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr double kPartsOfSide = 100;  // as a grid's resolution is by default
constexpr double kFlat = 1e-20;      // of its longest side's fourth power: the square of a triangle's area that is none
constexpr double kOnSurface = 1e-9;  // of a part: there a distance tells no direction
constexpr size_t kDeepest = 64;      // of a tree that halves 2^32 triangles, and room for both children

using Corners = std::array<Vec3, 3>;

Corners corners_of(const SurfaceField& f, uint32_t triangle) {
    const auto& [a, b, c] = f.surface->tree->triangles[triangle];
    return {f.surface->vertex(a, f.share), f.surface->vertex(b, f.share), f.surface->vertex(c, f.share)};
}

// The corner, side or inside that the point is nearest to (Ericson, Real-Time Collision Detection, 5.1.5).
Vec3 nearest_weight(const Corners& p, const Vec3& x) {
    const Vec3 ab = p[1] - p[0], ac = p[2] - p[0], ax = x - p[0], bx = x - p[1], cx = x - p[2];
    const double d1 = ab.dot(ax), d2 = ac.dot(ax), d3 = ab.dot(bx), d4 = ac.dot(bx), d5 = ab.dot(cx), d6 = ac.dot(cx);
    if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
    if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
    if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        const double t = d1 / (d1 - d3);
        return {1 - t, t, 0};
    }
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        const double t = d2 / (d2 - d6);
        return {1 - t, 0, t};
    }
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) {
        const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {0, 1 - t, t};
    }
    const double sum = va + vb + vc;
    return {1 - vb / sum - vc / sum, vb / sum, vc / sum};
}

double squared_distance(const Aabb& box, const Vec3& x) {
    return (x - x.cwiseMax(box.min).cwiseMin(box.max)).squaredNorm();
}

void try_triangle(const SurfaceField& f, uint32_t triangle, const Vec3& x, NearestPoint& io_best) {
    const Corners p = corners_of(f, triangle);
    const Vec3 w = nearest_weight(p, x), point = w[0] * p[0] + w[1] * p[1] + w[2] * p[2];
    const double squared = (x - point).squaredNorm();
    if (squared < io_best.squared) io_best = {triangle, w, point, squared};
}

// Unit, or null of one that is flat.
Vec3 normal_of(const SurfaceField& f, uint32_t triangle) {
    const Corners p = corners_of(f, triangle);
    const Vec3 n = (p[1] - p[0]).cross(p[2] - p[0]);
    const double longest = std::max((p[1] - p[0]).squaredNorm(), (p[2] - p[0]).squaredNorm()),
                 squared = n.squaredNorm();
    return squared > kFlat * longest * longest ? Vec3(n / std::sqrt(squared)) : Vec3(Vec3::Zero());
}

double angle_at(const Corners& p, int corner) {
    const Vec3 u = p[(corner + 1) % 3] - p[corner], v = p[(corner + 2) % 3] - p[corner];
    return math::atan2(u.cross(v).norm(), u.dot(v));
}

Vec3 fan_normal(const SurfaceField& f, uint32_t vertex) {
    const SurfaceTree& tree = *f.surface->tree;
    Vec3 sum = Vec3::Zero();
    for (uint32_t k = tree.fan_offset[vertex]; k < tree.fan_offset[vertex + 1]; ++k) {
        const Triangle& t = tree.triangles[tree.fan[k]];
        const int corner = t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
        sum += angle_at(corners_of(f, tree.fan[k]), corner) * normal_of(f, tree.fan[k]);
    }
    return sum;
}

Vec3 side_normal(const SurfaceField& f, uint32_t a, uint32_t b) {
    const SurfaceTree& tree = *f.surface->tree;
    Vec3 sum = Vec3::Zero();
    for (uint32_t k = tree.fan_offset[a]; k < tree.fan_offset[a + 1]; ++k)
        if (std::ranges::count(tree.triangles[tree.fan[k]], b) > 0) sum += normal_of(f, tree.fan[k]);
    return sum;
}

// Of what the point lies on, a face, a side or a corner; of any length.
Vec3 normal_at(const SurfaceField& f, const NearestPoint& p) {
    const Triangle& t = f.surface->tree->triangles[p.triangle];
    std::array<uint32_t, 3> on;
    int n = 0;
    for (int k = 0; k < 3; ++k)
        if (p.weight[k] > 0) on[n++] = t[k];
    Vec3 normal = n == 1 ? fan_normal(f, on[0]) : n == 2 ? side_normal(f, on[0], on[1]) : normal_of(f, p.triangle);
    if (normal.isZero(0))  // all flat: as those around it say
        for (const uint32_t v : t) normal += fan_normal(f, v);
    return normal;
}

}  // namespace

SurfaceField::SurfaceField(const Shape& shape)
    : surface(shape.surface), share(shape.share), bounds(surface->box(0, share)), voxel_size(0) {
    const Vec3 half = Vec3::Constant(0.5 * surface->tree->thickness);
    bounds.min -= half, bounds.max += half;
    voxel_size = (bounds.max - bounds.min).maxCoeff() / kPartsOfSide;
}

SurfaceField SurfaceField::at(double other_share) const {
    Shape shape;
    shape.kind = ShapeKind::mesh, shape.surface = surface, shape.share = other_share;
    SurfaceField other(shape);
    other.near = near;
    return other;
}

NearestPoint nearest(const SurfaceField& f, const Vec3& x) {
    const MovingSurface& s = *f.surface;
    NearestPoint best;
    best.squared = std::numeric_limits<double>::infinity();
    try_triangle(f, f.near, x, best);
    struct Entry {
        uint32_t node;
        double squared;
    };
    std::array<Entry, 2 * kDeepest> stack;
    size_t n = 0;
    stack[n++] = {0, squared_distance(s.box(0, f.share), x)};
    while (n > 0) {
        const Entry entry = stack[--n];
        if (entry.squared >= best.squared) continue;
        const SurfaceTree::Node& node = s.tree->nodes[entry.node];
        if (node.right == 0) {
            for (uint32_t t = node.begin; t < node.end; ++t) try_triangle(f, t, x, best);
            continue;
        }
        Entry left{entry.node + 1, squared_distance(s.box(entry.node + 1, f.share), x)},
            right{node.right, squared_distance(s.box(node.right, f.share), x)};
        if (left.squared < right.squared) std::swap(left, right);
        stack[n++] = left, stack[n++] = right;  // the nearer comes first
    }
    f.near = best.triangle;
    return best;
}

GridSample sample(const SurfaceField& f, const Vec3& x) {
    const NearestPoint p = nearest(f, x);
    const double distance = std::sqrt(p.squared), thickness = f.surface->tree->thickness;
    const bool tells = distance > kOnSurface * f.voxel_size;
    GridSample s;
    if (thickness > 0 && tells) {
        s.distance = distance - 0.5 * thickness, s.gradient = (x - p.point) / distance;
        return s;
    }
    const Vec3 normal = normal_at(f, p);
    const double side = thickness > 0 || normal.dot(x - p.point) >= 0 ? 1 : -1;
    s.distance = side * distance - 0.5 * thickness;
    s.gradient = tells ? Vec3(side / distance * (x - p.point)) : normal.normalized();
    return s;
}

std::optional<double> fastest_in(const SurfaceField& f, double end_share, const Aabb& box) {
    const MovingSurface& s = *f.surface;
    const Vec3 half = Vec3::Constant(0.5 * s.tree->thickness);
    const auto meets = [&](uint32_t node) {
        const Aabb begin = s.box(node, f.share), end = s.box(node, end_share);
        return ((begin.min.cwiseMin(end.min) - half).array() <= box.max.array()).all() &&
               ((begin.max.cwiseMax(end.max) + half).array() >= box.min.array()).all();
    };
    double squared = -1;
    std::array<uint32_t, 2 * kDeepest> stack;
    size_t n = 0;
    stack[n++] = 0;
    while (n > 0) {
        const uint32_t at = stack[--n];
        if (!meets(at)) continue;
        const SurfaceTree::Node& node = s.tree->nodes[at];
        if (node.right != 0) {
            stack[n++] = at + 1, stack[n++] = node.right;
            continue;
        }
        for (uint32_t t = node.begin; t < node.end; ++t)
            for (const uint32_t v : s.tree->triangles[t]) squared = std::max(squared, s.way[v].squaredNorm());
    }
    if (squared < 0) return {};
    return std::sqrt(squared) * (end_share - f.share);
}

Vec3 way_at(const SurfaceField& f, const Vec3& x) {
    const NearestPoint p = nearest(f, x);
    const auto& [a, b, c] = f.surface->tree->triangles[p.triangle];
    const std::vector<Vec3>& way = f.surface->way;
    return p.weight[0] * way[a] + p.weight[1] * way[b] + p.weight[2] * way[c];
}

}  // namespace sunder
