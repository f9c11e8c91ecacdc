#include "solver/collision/grid_box_contacts.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "solver/collision/grid_trace.h"
#include "solver/collision/surface_distance.h"

namespace sunder {
namespace {

constexpr int kDepth = 3;            // a face is divided into at most 8 x 8 parts
constexpr double kBulge = 0.02;      // of a voxel: how much nearer than its corners say a face must come to the mesh
constexpr double kBoxApart = 0.2;    // of the box's half diagonal: points nearer to one another are one
constexpr double kBoxAligned = 0.7;  // cosine from which the box's own normal is taken instead of the gradient
constexpr double kOnBorder = 1e-9;   // of the half extent: on the border

struct BoxPoint {
    Vec3 p;  // in the box's frame
    GridSample at;
};

template <class Field>
struct BoxOn {
    const Field& field;
    const Vec3 e;
    const Pose pose;
    const Mat3 Q = pose.orientation.toRotationMatrix();

    Vec3 place(const Vec3& p) const { return pose.position + Q * p; }
    BoxPoint at(const Vec3& p) const { return {p, sample(field, place(p))}; }
    Vec3 corner(int k) const { return {k & 1 ? e.x() : -e.x(), k & 2 ? e.y() : -e.y(), k & 4 ? e.z() : -e.z()}; }

    /// Goes down within the face i, stopping at its border.
    BoxPoint descend(BoxPoint now, int i, double step) const {
        constexpr int kMostSteps = 12;
        const double least = 1e-4 * step;
        for (int k = 0; k < kMostSteps && step > least; ++k) {
            Vec3 down = -(Q.transpose() * now.at.gradient);
            down[i] = 0;
            const double length = down.norm();
            if (!(length > 1e-6)) break;
            const Vec3 p = (now.p + step / length * down).cwiseMax(-e).cwiseMin(e);
            const BoxPoint next = at(p);
            if (next.at.distance < now.at.distance)
                now = next;
            else
                step *= 0.4;
        }
        return now;
    }

    /// Of a minimum over the box the gradient has no part along its face or edge; what is left of it there is rounding
    /// at an edge of the mesh.
    Vec3 normal(const BoxPoint& c) const {
        const Vec3 out = way_out(field, c.at, place(c.p)), in_box = Q.transpose() * out;
        Vec3 n = in_box;
        for (int i = 0; i < 3; ++i)
            if (std::abs(c.p[i]) < (1 - kOnBorder) * e[i]) n[i] = 0;
        const double length = n.norm();
        return length > kBoxAligned ? Vec3(Q * (n / length)) : out;
    }

    /// Distance that the corners of the face i, at the side of p, say that p has.
    double from_corners(const Vec3& p, int i, const std::array<BoxPoint, 8>& corners) const {
        double sum = 0;
        for (int k = 0; k < 8; ++k) {
            double weight = 1;
            for (int j = 0; j < 3; ++j) {
                const bool above = k & (1 << j);
                if (j == i)
                    weight *= above == (p[j] > 0);
                else
                    weight *= 0.5 * (above ? 1 + p[j] / e[j] : 1 - p[j] / e[j]);
            }
            sum += weight * corners[k].at.distance;
        }
        return sum;
    }

    /// Parts of the face i that come within `within`, the distance changing by no more than the way: their middles.
    void parts(const Vec3& middle, const Vec3& half, int depth, double within, std::vector<BoxPoint>& out) const {
        const BoxPoint c = at(middle);
        const double reach = half.norm();
        if (c.at.distance - reach > within) return;
        if (depth == kDepth || reach < field.voxel_size) {
            out.push_back(c);
            return;
        }
        for (int k = 0; k < 4; ++k) {
            Vec3 quarter = middle;
            for (int j = 0, bit = 1; j < 3; ++j) {
                if (half[j] == 0) continue;
                quarter[j] += k & bit ? 0.5 * half[j] : -0.5 * half[j];
                bit <<= 1;
            }
            parts(quarter, 0.5 * half, depth + 1, within, out);
        }
    }
};

template <class Field>
Separation separation(const BoxOn<Field>& box, const Vec3& p, const Vec3& n, double gap) {
    Separation s;
    s.normal = n;
    s.gap = gap;
    s.point_a = box.place(p);
    s.point_b = s.point_a - gap * n;
    return s;
}

/// Adds up to `most` of the pool: the deepest, then those farthest from what is chosen already.
template <class Field>
void add_spread(const BoxOn<Field>& box, const std::vector<BoxPoint>& pool, double apart, int most, Manifold& io_m) {
    double deepest = std::numeric_limits<double>::infinity();
    for (const BoxPoint& c : pool) deepest = std::min(deepest, c.at.distance);
    for (int k = 0; k < most; ++k) {
        const BoxPoint* best = nullptr;
        double best_score = -std::numeric_limits<double>::infinity();
        for (const BoxPoint& c : pool) {
            const Vec3 x = box.place(c.p);
            double away = 4 * box.e.norm();
            for (int j = 0; j < io_m.count; ++j) away = std::min(away, (io_m.points[j].point_a - x).norm());
            const double score = away - 4 * (c.at.distance - deepest);  // a little nearer to the mesh, or far off
            if (away >= apart && score > best_score) best = &c, best_score = score;
        }
        if (!best) return;
        io_m.add(separation(box, best->p, box.normal(*best), best->at.distance));
    }
}

template <class Field>
Manifold box_contacts(const Field& field, const Vec3& half_extents, const Pose& pose, double within) {
    const BoxOn<Field> box{field, half_extents, pose};
    const Vec3& e = half_extents;
    const double radius = e.norm();
    Manifold m;
    const GridSample center = sample(field, pose.position);
    if (center.distance - radius >= within) return m;

    std::array<BoxPoint, 8> corners;
    for (int k = 0; k < 8; ++k) corners[k] = box.at(box.corner(k));
    const auto add_plane = [&](const Vec3& n, const Vec3& foot, int k) {
        const double gap = n.dot(box.place(corners[k].p) - foot);
        if (gap < within) m.add(separation(box, corners[k].p, n, gap));
    };
    if (center.distance <= 0) {  // deep: the shortest way out of its centre
        const Vec3 out = way_out(field, center, pose.position);
        for (int k = 0; k < 8; ++k) add_plane(out, pose.position - center.distance * out, k);
        return m;
    }
    for (int k = 0; k < 8; ++k)
        if (const auto wall = wall_between(field, pose.position, center, box.place(corners[k].p)))
            add_plane(wall->normal, wall->point, k);
    if (m.count > 0) return m;

    std::vector<BoxPoint> pool, inner;
    for (int i = 0; i < 3; ++i)
        for (const double side : {-1.0, 1.0}) {
            Vec3 middle = Vec3::Zero(), half = e;
            middle[i] = side * e[i];
            half[i] = 0;
            inner.clear();
            box.parts(middle, half, 0, within, inner);
            for (const BoxPoint& c : inner) {
                if (c.at.distance > box.from_corners(c.p, i, corners) - kBulge * field.voxel_size) continue;
                const BoxPoint low = box.descend(c, i, half.norm() / (1 << kDepth));
                if (low.at.distance < within) pool.push_back(low);
            }
        }
    std::vector<BoxPoint> touching;
    for (const BoxPoint& c : corners)
        if (c.at.distance < within) touching.push_back(c);
    // Half of the places are kept for what bulges into faces and edges, and is nearer than the corners.
    add_spread(box, touching, kOnBorder * radius, pool.empty() ? 8 : 4, m);
    add_spread(box, pool, kBoxApart * radius, 4, m);
    std::stable_sort(m.points.begin(), m.points.begin() + m.count,
                     [](const Separation& x, const Separation& y) { return x.gap < y.gap; });
    return m;
}

}  // namespace

Manifold box_grid_contacts(const SignedDistanceGrid& grid, const Vec3& half_extents, const Pose& pose, double within) {
    return box_contacts(grid, half_extents, pose, within);
}

Manifold box_grid_contacts(const SurfaceField& surface, const Vec3& half_extents, const Pose& pose, double within) {
    return box_contacts(surface, half_extents, pose, within);
}

}  // namespace sunder
