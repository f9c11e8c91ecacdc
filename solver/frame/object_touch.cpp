#include "solver/frame/object_touch.h"

#include <algorithm>
#include <cmath>

#include "solver/collision/shape_distance.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

constexpr int kMostPlaces = 256;      // of the shape in a frame
constexpr int kMostDescents = 64;     // towards the point of the hull that is deepest in the shape
constexpr int kHalvings = 30;         // of the way of a descent
constexpr double kLeastShift = 1e-8;  // of all shares, that is a descent

// Of a hull a point, as shares of its corners.
struct HullPoint {
    const std::vector<Vec3>& corners;
    std::vector<double> share;
    Vec3 x;

    HullPoint(const std::vector<Vec3>& hull, size_t corner) : corners(hull), share(hull.size(), 0), x(hull[corner]) {
        share[corner] = 1;
    }
    size_t lowest(const Vec3& slope) const {
        size_t low = 0;
        for (size_t c = 1; c < corners.size(); ++c)
            if (slope.dot(corners[c]) < slope.dot(corners[low])) low = c;
        return low;
    }
    size_t highest_shared(const Vec3& slope) const {
        size_t high = corners.size();
        for (size_t c = 0; c < corners.size(); ++c)
            if (share[c] > 0 && (high == corners.size() || slope.dot(corners[c]) > slope.dot(corners[high]))) high = c;
        return high;
    }
    void shift(size_t from, size_t to, double by) {
        share[to] += by, share[from] = by < share[from] ? share[from] - by : 0;
        x += by * (corners[to] - corners[from]);
    }
};

// The distance to a convex shape is convex: over the hull it is least where no corner is lower along its slope. Shares
// go from the highest corner that has some to the lowest (pairwise steps: Frank and Wolfe 1956; Lacoste-Julien and
// Jaggi 2015), and nowhere is it lower than what the slope at any point says of the lowest corner.
bool touches(const std::vector<Vec3>& corners, const Vec3& middle, const PlacedShape& shape, double beyond) {
    const auto separation = [&](const Vec3& x) {
        Separation s = point_shape_distance(x, shape);
        s.gap -= beyond;
        return s;
    };
    const auto gap = [&](const Vec3& x) { return separation(x).gap; };
    if (gap(middle) <= 0) return true;
    size_t nearest = 0;
    for (size_t c = 1; c < corners.size(); ++c)
        if (gap(corners[c]) < gap(corners[nearest])) nearest = c;
    HullPoint point(corners, nearest);
    for (int k = 0; k < kMostDescents; ++k) {
        const Separation at = separation(point.x);
        if (at.gap <= 0) return true;
        const size_t low = point.lowest(at.normal), high = point.highest_shared(at.normal);
        const bool is_convex = shape.shape.kind != ShapeKind::mesh;
        if (low == high || (is_convex && at.gap + at.normal.dot(corners[low] - point.x) > 0)) return false;
        const Vec3 way = corners[low] - corners[high];
        double begin = 0, end = point.share[high];  // the least of a convex function along the way lies between
        for (int halving = 0; halving < kHalvings; ++halving) {
            const double half = 0.5 * (begin + end);
            const Separation there = separation(point.x + half * way);
            if (there.gap <= 0) return true;
            (there.normal.dot(way) < 0 ? begin : end) = half;
        }
        if (end < kLeastShift) return false;
        point.shift(high, low, end);
    }
    return false;
}

std::vector<Vec3> corners_of(const SimulationMesh& rest, const FrameState& s, ParticleId i) {
    const Quat turned = s.orientation[i] * rest.rest_orientation[i].conjugate();
    std::vector<Vec3> corners;
    for (const Vec3f& p : rest.hull(i))
        corners.push_back(s.position[i] + turned * (s.plastic_deformation[i] * p.cast<double>()));
    return corners;
}

}  // namespace

bool comes_over(const Shape& shape, const DrivenPose& way, const SimulationMesh& rest, const FrameState& state,
                ParticleId i, double beyond) {
    const Vec3& x = state.position[i];
    const std::vector<Vec3> corners = corners_of(rest, state, i);
    double reach = rest.radii[i].maxCoeff();
    for (const Vec3& c : corners) reach = std::max(reach, (c - x).norm());
    const double length = (way.begin.apply(way.end.inverse_apply(x)) - x).norm() + deformation_of(way);
    const double nearest = std::min(point_shape_distance(x, {shape_at(shape, way, 0), way.begin}).gap,
                                    point_shape_distance(x, {shape_at(shape, way, 1), way.end}).gap);
    if (nearest > reach + length + beyond) return false;
    const double step = 0.25 * rest.radii[i].minCoeff();
    const int places = static_cast<int>(std::clamp(std::ceil(length / step), 1.0, double(kMostPlaces)));
    const Ellipsoid ellipsoid{x, state.orientation[i].toRotationMatrix(), rest.radii[i]};
    for (int k = 0; k <= places; ++k) {
        const double share = double(k) / places;
        const PlacedShape placed{shape_at(shape, way, share), interpolate(way, share)};
        if (point_shape_distance(x, placed).gap > reach + beyond) continue;
        if (corners.empty() ? ellipsoid_shape_distance(ellipsoid, placed).gap <= beyond
                            : touches(corners, x, placed, beyond))
            return true;
    }
    return false;
}

}  // namespace sunder
