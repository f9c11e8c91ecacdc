#include "solver/collision/grid_distance.h"

#include <algorithm>
#include <span>

#include "solver/collision/grid_box_contacts.h"
#include "solver/collision/grid_trace.h"
#include "solver/collision/surface_distance.h"
#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr int kMostPoints = 4;        // of one ellipsoid: three make it rest, one to spare
constexpr int kStarts = 5;            // descents from the best of the fixed directions
constexpr double kApart = 0.35;       // rad (of the unit sphere): minima nearer to one another are one
constexpr double kStartsApart = 0.7;  // rad: starts nearer to one another end alike
constexpr double kAligned = 0.7;      // cosine from which a point counts as a minimum: there the two normals agree

/// The ellipsoid in the field's frame: x = center + B u, |u| = 1.
struct Placed {
    Vec3 center;
    Mat3 B;
};

struct Candidate {
    Vec3 u;  // on the unit sphere
    GridSample at;
};

template <class Field>
Candidate evaluate(const Field& field, const Placed& e, const Vec3& u) {
    return {u, sample(field, e.center + e.B * u)};
}

/// Goes down from `start` towards the support point against the gradient, which is the minimum wherever the distance is
/// linear; shorter steps where the surface curves more than the ellipsoid.
template <class Field>
Candidate descend(const Field& field, const Placed& e, Candidate now) {
    constexpr int kMostSteps = 12;
    double share = 1;
    for (int k = 0; k < kMostSteps; ++k) {
        const Vec3 down = -(e.B.transpose() * now.at.gradient);
        const double length = down.norm();
        if (!(length > 0)) break;
        const Vec3 step = down / length - now.u;
        if (step.squaredNorm() < 1e-10) break;
        bool fell = false;
        for (int tries = 0; tries < 4 && !fell; ++tries) {
            const Vec3 u = now.u + share * step;
            const double size = u.norm();
            if (size > 1e-6) {
                const Candidate next = evaluate(field, e, u / size);
                fell = next.at.distance < now.at.distance;
                if (fell) now = next;
            }
            if (!fell) share *= 0.4;
        }
        if (!fell) break;
        share = std::min(1.0, 2 * share);
    }
    return now;
}

/// The 26 directions to the neighbours in a cube.
struct Directions {
    std::array<Vec3, 26> u;
    Directions() {
        size_t n = 0;
        for (int i = -1; i <= 1; ++i)
            for (int j = -1; j <= 1; ++j)
                for (int k = -1; k <= 1; ++k)
                    if (i || j || k) u[n++] = Vec3(i, j, k).normalized();
    }
};

/// Keeps the lowest of `all` (sorted) that are `apart` from one another.
template <size_t kMost>
int spread(std::span<const Candidate> all, double apart, std::array<Candidate, kMost>& out) {
    const double least = apart * apart;
    int n = 0;
    for (const Candidate& c : all) {
        if (n == int(kMost)) break;
        const bool near = std::any_of(out.begin(), out.begin() + n,
                                      [&](const Candidate& o) { return (o.u - c.u).squaredNorm() < least; });
        if (!near) out[n++] = c;
    }
    return n;
}

bool lower(const Candidate& x, const Candidate& y) { return x.at.distance < y.at.distance; }

/// The plane at `foot` with normal n against the ellipsoid's support point.
Separation against_plane(const Placed& e, const Vec3& n, const Vec3& foot) {
    const Vec3 half = e.B.transpose() * n;
    Separation s;
    s.normal = n;
    s.point_a = e.center - e.B * half / half.norm();
    s.gap = n.dot(s.point_a - foot);
    s.point_b = s.point_a - s.gap * n;
    return s;
}

/// The ellipsoid's own normal at the point, towards its inside: at a minimum the gradient's direction, but for edges of
/// the mesh, where the gradient may have any direction between two faces.
Vec3 inward(const Placed& e, const Candidate& c) { return -(e.B.transpose().inverse() * c.u).normalized(); }

bool is_minimum(const Placed& e, const Candidate& c) {
    return inward(e, c).dot(c.at.gradient) >= kAligned * c.at.gradient.norm();
}

template <class Field>
Separation as_separation(const Field& field, const Placed& e, const Candidate& c) {
    Separation s;
    s.normal = is_minimum(e, c) ? inward(e, c) : way_out(field, c.at, e.center + e.B * c.u);
    s.gap = c.at.distance;
    s.point_a = e.center + e.B * c.u;
    s.point_b = s.point_a - s.gap * s.normal;
    return s;
}

template <class Field>
Manifold local_contacts(const Field& field, const Placed& e) {
    Manifold m;
    const GridSample center = sample(field, e.center);
    const Vec3 out = way_out(field, center, e.center);
    if (center.distance <= 0) {
        m.add(against_plane(e, out, e.center - center.distance * out));
        return m;
    }
    const Separation below = against_plane(e, out, e.center - center.distance * out);
    if (const auto wall = wall_between(field, e.center, center, below.point_a)) {
        m.add(against_plane(e, wall->normal, wall->point));
        return m;
    }

    static const Directions directions;
    std::array<Candidate, 26> all;
    for (size_t k = 0; k < all.size(); ++k) all[k] = evaluate(field, e, directions.u[k]);
    std::ranges::stable_sort(all, lower);
    std::array<Candidate, kStarts> starts;
    const int n_starts = spread(all, kStartsApart, starts);
    std::array<Candidate, kStarts + 1> found;
    int n = 0;
    found[n++] = descend(field, e, evaluate(field, e, -(e.B.transpose() * out).normalized()));
    for (int k = 0; k < n_starts; ++k) found[n++] = descend(field, e, starts[k]);
    std::stable_sort(found.begin(), found.begin() + n, lower);
    std::array<Candidate, kMostPoints> minima;
    const int n_minima = spread({found.data(), size_t(n)}, kApart, minima);
    for (int k = 0; k < n_minima; ++k) {
        if (k == 0 || is_minimum(e, minima[k])) m.add(as_separation(field, e, minima[k]));
    }
    return m;
}

}  // namespace

GridSample sample(const SignedDistanceGrid& grid, const Vec3& x) {
    const Vec3 p = (x - grid.origin) / grid.voxel_size;
    Vec3 q;
    size_t cell[3];
    double t[3];
    for (int i = 0; i < 3; ++i) {
        const double last = double(grid.nodes[i] - 1);
        q[i] = std::clamp(p[i], 0.0, last);
        cell[i] = std::min(static_cast<size_t>(q[i]), size_t(grid.nodes[i]) - 2);
        t[i] = q[i] - double(cell[i]);
    }
    const size_t z = 1, y = grid.nodes[2], xx = y * grid.nodes[1];
    const float* c = grid.distance.data() + grid.index(cell[0], cell[1], cell[2]);
    const double c000 = c[0], c001 = c[z], c010 = c[y], c011 = c[y + z];
    const double c100 = c[xx], c101 = c[xx + z], c110 = c[xx + y], c111 = c[xx + y + z];
    const double c00 = c000 + t[2] * (c001 - c000), c01 = c010 + t[2] * (c011 - c010);
    const double c10 = c100 + t[2] * (c101 - c100), c11 = c110 + t[2] * (c111 - c110);
    const double c0 = c00 + t[1] * (c01 - c00), c1 = c10 + t[1] * (c11 - c10);
    const double dz0 = (c001 - c000) + t[1] * ((c011 - c010) - (c001 - c000));
    const double dz1 = (c101 - c100) + t[1] * ((c111 - c110) - (c101 - c100));
    GridSample s;
    s.distance = c0 + t[0] * (c1 - c0);
    s.gradient =
        Vec3(c1 - c0, (c01 - c00) + t[0] * ((c11 - c10) - (c01 - c00)), dz0 + t[0] * (dz1 - dz0)) / grid.voxel_size;
    const Vec3 beyond = (p - q) * grid.voxel_size;
    if (beyond.isZero(0)) return s;
    for (int i = 0; i < 3; ++i)
        if (beyond[i] != 0) s.gradient[i] = 0;
    const double distance = math::hypot(s.distance, beyond.norm());
    s.gradient = (s.distance * s.gradient + beyond) / distance;
    s.distance = distance;
    return s;
}

template <class Field>
Separation point_grid_distance(const Vec3& point, const Field& field, const Pose& pose) {
    const Vec3 x = pose.inverse_apply(point);
    const GridSample at = sample(field, x);
    Separation s;
    s.normal = pose.orientation * way_out(field, at, x);
    s.gap = at.distance;
    s.point_a = point;
    s.point_b = point - s.gap * s.normal;
    return s;
}

template <class Field>
Manifold ellipsoid_grid_contacts(const Ellipsoid& a, const Field& field, const Pose& pose) {
    const Mat3 Q = pose.orientation.toRotationMatrix();
    return in_world(local_contacts(field, {Q.transpose() * (a.center - pose.position),
                                           Q.transpose() * a.axes * a.radii.asDiagonal()}),
                    pose);
}

template <class Field>
Manifold rigid_grid_contacts(const PlacedShape& a, const Field& field, const Pose& pose, double within) {
    SUNDER_ASSERT(a.shape.kind == ShapeKind::sphere || a.shape.kind == ShapeKind::box);
    Manifold m;
    if (a.shape.kind == ShapeKind::sphere) {
        const Ellipsoid ball{a.pose.position, Mat3::Identity(), Vec3::Constant(a.shape.radius)};
        const Manifold all = ellipsoid_grid_contacts(ball, field, pose);
        for (int k = 0; k < all.count; ++k)
            if (all.points[k].gap < within) m.add(all.points[k]);
        return m;
    }
    const Pose in_grid{pose.inverse_apply(a.pose.position), pose.orientation.conjugate() * a.pose.orientation};
    return in_world(box_grid_contacts(field, a.shape.half_extents, in_grid, within), pose);
}

template Separation point_grid_distance(const Vec3&, const SignedDistanceGrid&, const Pose&);
template Manifold ellipsoid_grid_contacts(const Ellipsoid&, const SignedDistanceGrid&, const Pose&);
template Manifold rigid_grid_contacts(const PlacedShape&, const SignedDistanceGrid&, const Pose&, double);
template Separation point_grid_distance(const Vec3&, const SurfaceField&, const Pose&);
template Manifold ellipsoid_grid_contacts(const Ellipsoid&, const SurfaceField&, const Pose&);
template Manifold rigid_grid_contacts(const PlacedShape&, const SurfaceField&, const Pose&, double);

}  // namespace sunder
