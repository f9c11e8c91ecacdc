#include "solver/collision/box_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sunder {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kFaceShare = 0.02;    // an edge axis must be shallower by this share of the depth to win
constexpr double kBoxRounding = 1e-9;  // of the box's size: differences below it decide nothing

struct Frame {
    Vec3 center, half;  // m
    Mat3 axes;          // columns, world

    explicit Frame(const PlacedShape& box)
        : center(box.pose.position), half(box.shape.half_extents), axes(box.pose.orientation.toRotationMatrix()) {}

    double support(const Vec3& n) const { return half.dot((axes.transpose() * n).cwiseAbs()); }
    Vec3 corner(int k) const {
        return center +
               axes * Vec3(k & 1 ? half.x() : -half.x(), k & 2 ? half.y() : -half.y(), k & 4 ? half.z() : -half.z());
    }
    /// Ends of edge k (0 .. 11): along axis k / 4, at the corner k % 4 of the two other axes.
    void edge(int k, Vec3& from, Vec3& to) const {
        const int i = k / 4, j = (i + 1) % 3, l = (i + 2) % 3;
        Vec3 p;
        p[j] = k & 1 ? half[j] : -half[j];
        p[l] = k & 2 ? half[l] : -half[l];
        p[i] = -half[i];
        from = center + axes * p;
        p[i] = half[i];
        to = center + axes * p;
    }
};

/// Nearest points of two segments (Ericson 2005, 5.1.9).
void nearest_on_segments(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1, Vec3& p, Vec3& q) {
    const Vec3 u = p1 - p0, v = q1 - q0, w = p0 - q0;
    const double uu = u.dot(u), vv = v.dot(v), uv = u.dot(v), uw = u.dot(w), vw = v.dot(w);
    const double det = uu * vv - uv * uv;
    double s = det > 1e-14 * uu * vv ? std::clamp((uv * vw - uw * vv) / det, 0.0, 1.0) : 0.5;
    const double t = std::clamp((uv * s + vw) / vv, 0.0, 1.0);
    s = std::clamp((uv * t - uw) / uu, 0.0, 1.0);
    p = p0 + s * u;
    q = q0 + t * v;
}

/// Exact nearest points of two boxes that are apart: over corners against boxes and edges against edges.
Separation nearest_features(const PlacedShape& a, const PlacedShape& b, const Frame& A, const Frame& B) {
    Separation best;
    best.gap = kInfinity;
    for (int k = 0; k < 8; ++k) {
        const Separation of_a = point_shape_distance(A.corner(k), b);
        if (of_a.gap < best.gap) best = of_a;
        const Separation of_b = flipped(point_shape_distance(B.corner(k), a));
        if (of_b.gap < best.gap) best = of_b;
    }
    for (int i = 0; i < 12; ++i) {
        Vec3 p0, p1;
        A.edge(i, p0, p1);
        for (int j = 0; j < 12; ++j) {
            Vec3 q0, q1, p, q;
            B.edge(j, q0, q1);
            nearest_on_segments(p0, p1, q0, q1, p, q);
            const double distance = (p - q).norm();
            if (distance < best.gap && distance > 0) best = {(p - q) / distance, p, q, distance};
        }
    }
    return best;
}

/// Corners of the face of `incident` that looks most against `outward`, clipped to the sides of the reference face,
/// as contacts with the reference plane. `a_is_reference` tells which of the two is solid a.
Manifold face_contacts(const Frame& reference, int axis, const Vec3& outward, const Frame& incident,
                       bool a_is_reference) {
    const Vec3 along = incident.axes.transpose() * outward;
    int face = 0;
    along.cwiseAbs().maxCoeff(&face);
    const int j = (face + 1) % 3, l = (face + 2) % 3;
    constexpr int kMost = 8;
    Vec3 polygon[kMost + 1], clipped[kMost + 1];
    int n = 0;
    for (const auto& [sj, sl] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        Vec3 p;
        p[face] = along[face] > 0 ? -incident.half[face] : incident.half[face];
        p[j] = sj * incident.half[j];
        p[l] = sl * incident.half[l];
        polygon[n++] = incident.center + incident.axes * p;
    }
    for (int side = 0; side < 4; ++side) {  // Sutherland & Hodgman; each side adds one corner at most
        const int i = (axis + 1 + side / 2) % 3;
        const Vec3 m = side % 2 ? Vec3(-reference.axes.col(i)) : Vec3(reference.axes.col(i));
        const double limit = m.dot(reference.center) + reference.half[i];
        int kept = 0;
        for (int k = 0; k < n; ++k) {
            const Vec3 &p = polygon[k], &q = polygon[(k + 1) % n];
            const double dp = m.dot(p) - limit, dq = m.dot(q) - limit;
            if (dp <= 0 && kept < kMost) clipped[kept++] = p;
            if ((dp < 0 && dq > 0) || (dp > 0 && dq < 0)) {
                if (kept < kMost) clipped[kept++] = p + (q - p) * (dp / (dp - dq));
            }
        }
        n = kept;
        std::copy(clipped, clipped + n, polygon);
    }
    Manifold result;
    const double plane = outward.dot(reference.center) + reference.half[axis];
    for (int k = 0; k < n; ++k) {
        const double gap = outward.dot(polygon[k]) - plane;
        const Vec3 foot = polygon[k] - gap * outward;
        result.add(a_is_reference ? Separation{-outward, foot, polygon[k], gap}
                                  : Separation{outward, polygon[k], foot, gap});
    }
    return result;
}

/// Nearest points of the edges along axes i of A and j of B that lie deepest along n (from b to a).
Separation edge_contact(const Frame& A, int i, const Frame& B, int j, const Vec3& n, double gap) {
    const Vec3 towards_b = A.axes.transpose() * -n, towards_a = B.axes.transpose() * n;
    Vec3 pa, pb;
    for (int k = 0; k < 3; ++k) {
        pa[k] = towards_b[k] < 0 ? -A.half[k] : A.half[k];
        pb[k] = towards_a[k] < 0 ? -B.half[k] : B.half[k];
    }
    Vec3 pa2 = pa, pb2 = pb;
    pa2[i] = -pa[i];
    pb2[j] = -pb[j];
    Separation s;
    nearest_on_segments(A.center + A.axes * pa, A.center + A.axes * pa2, B.center + B.axes * pb,
                        B.center + B.axes * pb2, s.point_a, s.point_b);
    s.normal = n;
    s.point_b += n * (n.dot(s.point_a - s.point_b) - gap);
    s.gap = gap;
    return s;
}

}  // namespace

Manifold box_box_contacts(const PlacedShape& a, const PlacedShape& b) {
    const Frame A(a), B(b);
    const Vec3 d = A.center - B.center;
    const double size = A.half.maxCoeff() + B.half.maxCoeff();
    const auto oriented = [&](const Vec3& n) { return n.dot(d) < 0 ? Vec3(-n) : n; };
    const auto separation = [&](const Vec3& n) { return n.dot(d) - A.support(n) - B.support(n); };

    double face_gap = -kInfinity;
    int face = 0;  // 0-2: of a, 3-5: of b
    for (int k = 0; k < 6; ++k) {
        const double gap = separation(oriented(k < 3 ? A.axes.col(k) : B.axes.col(k - 3)));
        const double lead = kBoxRounding * size + (k == 3 ? kFaceShare * std::abs(face_gap) : 0);
        if (k == 0 || gap > face_gap + lead) {
            face_gap = gap;
            face = k;
        }
    }
    double edge_gap = -kInfinity;
    int edge_a = 0, edge_b = 0;
    Vec3 edge_normal = Vec3::Zero();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const Vec3 cross = A.axes.col(i).cross(B.axes.col(j));
            const double length = cross.norm();
            if (length < 1e-6) continue;  // parallel edges: the faces cover them
            const Vec3 n = oriented(cross / length);
            const double gap = separation(n);
            if (gap > edge_gap + kBoxRounding * size) {
                edge_gap = gap;
                edge_normal = n;
                edge_a = i;
                edge_b = j;
            }
        }

    const bool apart = face_gap > 0 || edge_gap > 0;
    const Separation nearest =
        apart ? nearest_features(a, b, A, B) : edge_contact(A, edge_a, B, edge_b, edge_normal, edge_gap);
    const bool on_face = nearest.gap <= face_gap + kFaceShare * std::abs(face_gap) + kBoxRounding * size;
    Manifold result;
    if (on_face) {
        const bool of_a = face < 3;
        const Vec3 n = oriented(of_a ? A.axes.col(face) : B.axes.col(face - 3));
        result = of_a ? face_contacts(A, face, -n, B, true) : face_contacts(B, face - 3, n, A, false);
        if (!apart) return result;
    }
    // What is nearest may lie just beyond the face's sides, where clipping lost it.
    if (result.least_gap() > nearest.gap + kBoxRounding * size) {
        if (result.count == int(result.points.size())) --result.count;
        result.add(nearest);
    }
    return result;
}

Manifold box_capsule_contacts(const PlacedShape& a, const PlacedShape& b) {
    const Frame A(a);
    const Vec3 e = A.half;
    const double r = b.shape.radius;
    const Vec3 p0 = a.pose.inverse_apply(b.pose.apply(Vec3(0, 0, -b.shape.half_height)));
    const Vec3 u = a.pose.inverse_apply(b.pose.apply(Vec3(0, 0, b.shape.half_height))) - p0;
    const auto beyond = [&](double t) -> Vec3 {  // from the box to the segment's point at t, in the box's frame
        const Vec3 p = p0 + t * u;
        return p - p.cwiseMax(-e).cwiseMin(e);
    };

    // The slope of the squared distance along the segment grows, linear between crossings of the face planes.
    double breaks[8] = {0, 1};  // ascending
    int n_breaks = 2;
    for (int i = 0; i < 3; ++i)
        for (const double side : {-e[i], e[i]}) {
            const double at = (side - p0[i]) / u[i];
            if (!(at > 0 && at < 1)) continue;
            int k = n_breaks++;
            for (; breaks[k - 1] > at; --k) breaks[k] = breaks[k - 1];
            breaks[k] = at;
        }
    const auto slope = [&](double t) { return beyond(t).dot(u); };
    double t = 0;
    if (slope(0) < 0) {
        t = 1;
        for (int k = 1; k < n_breaks; ++k) {
            const double before = slope(breaks[k - 1]), after = slope(breaks[k]);
            if (after < 0) continue;
            t = after > before ? breaks[k - 1] + (breaks[k] - breaks[k - 1]) * (-before / (after - before)) : breaks[k];
            break;
        }
    }
    Vec3 normal = beyond(t);  // from the box outwards, in its frame
    double distance = normal.norm();
    int face = -1;
    double from = 0, to = 1;  // the segment's part over the face, or inside the box
    const auto clip = [&](int i) {
        if (std::abs(u[i]) < 1e-300) {
            if (std::abs(p0[i]) > e[i]) to = -1;
            return;
        }
        const double t0 = (-e[i] - p0[i]) / u[i], t1 = (e[i] - p0[i]) / u[i];
        from = std::max(from, std::min(t0, t1));
        to = std::min(to, std::max(t0, t1));
    };
    const bool apart = distance > kBoxRounding * e.minCoeff();
    if (apart) {
        normal /= distance;
        const double along = normal.cwiseAbs().maxCoeff(&face);
        if (along < 0.95) face = -1;  // 18 degrees: no longer lying on the face
    } else {                          // the axis enters the box: shortest of faces and face-edge axes
        const Vec3 middle = p0 + 0.5 * u, half = 0.5 * u;
        distance = -kInfinity;
        const auto consider = [&](Vec3 n, int of_face) {
            if (n.dot(middle) < 0) n = -n;
            const double gap = n.dot(middle) - std::abs(n.dot(half)) - e.dot(n.cwiseAbs());
            if (gap > distance + kBoxRounding * e.maxCoeff()) {
                distance = gap;
                normal = n;
                face = of_face;
            }
        };
        for (int i = 0; i < 3; ++i) consider(Vec3::Unit(i), i);
        for (int i = 0; i < 3; ++i)
            if (const Vec3 cross = Vec3::Unit(i).cross(u); cross.norm() > 1e-6 * u.norm())
                consider(cross.normalized(), -1);
        if (face < 0) {
            for (int i = 0; i < 3; ++i) clip(i);
            t = 0.5 * (from + to);
        }
    }

    Manifold result;
    const auto add = [&](double at, const Vec3& n, double core_gap) {  // n: from the box outwards, in its frame
        const Vec3 core = p0 + at * u, world_n = A.axes * n;
        Separation s;
        s.normal = -world_n;
        s.gap = core_gap - r;
        s.point_a = a.pose.apply(core - core_gap * n);
        s.point_b = a.pose.apply(core) - r * world_n;
        result.add(s);
    };
    if (face >= 0) {
        from = 0, to = 1;
        clip((face + 1) % 3);
        clip((face + 2) % 3);
        Vec3 n = Vec3::Zero();
        n[face] = normal[face] < 0 ? -1 : 1;
        const auto over_face = [&](double at) { add(at, n, n.dot(p0 + at * u) - e[face]); };
        if (to >= from) {
            over_face(from);
            if ((to - from) * u.norm() > kBoxRounding * e.minCoeff()) over_face(to);
            if (!apart) return result;
        }
    }
    // What is nearest may lie just beyond the face's sides, where clipping lost it.
    if (result.least_gap() > distance - r + kBoxRounding * e.maxCoeff()) add(t, normal, distance);
    return result;
}

}  // namespace sunder
