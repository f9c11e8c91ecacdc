#include "solver/collision/surface_contacts.h"

#include <algorithm>
#include <cmath>

#include "solver/collision/first_touch.h"
#include "solver/collision/surface_distance.h"

namespace sunder {
namespace {

constexpr int kMostAdvances = 64;  // grazing ways advance slowly; past it all that the rest of the way may meet counts
constexpr int kMostSlides = 8;
constexpr double kHeld = 0.2;  // of a way, the part that is left where others hold it from all sides

// What moves past the mesh: where it is at the begin, and how to ask what it touches elsewhere.
template <class Solid>
struct Mover {
    const Solid& solid;
    Vec3 center;
    double farthest, nearest;  // of its surface from there, m

    Manifold at(const Vec3& offset, const SurfaceField& field, const Pose& pose, double within) const;
};

template <>
Manifold Mover<Ellipsoid>::at(const Vec3& offset, const SurfaceField& field, const Pose& pose, double within) const {
    Ellipsoid moved = solid;
    moved.center += offset;
    const Manifold all = ellipsoid_grid_contacts(moved, field, pose);
    Manifold m;
    for (int k = 0; k < all.count; ++k)
        if (all.points[k].gap < within) m.add(all.points[k]);
    return m;
}

template <>
Manifold Mover<PlacedShape>::at(const Vec3& offset, const SurfaceField& field, const Pose& pose, double within) const {
    PlacedShape moved = solid;
    moved.pose.position += offset;
    return rigid_grid_contacts(moved, field, pose, within);
}

// The box of a way, as the mesh sees it.
Aabb box_of_way(const Vec3& begin, const Vec3& shift, double reach, const Pose& pose) {
    Aabb box;
    box.extend(pose.inverse_apply(begin)), box.extend(pose.inverse_apply(begin + shift));
    box.min.array() -= reach, box.max.array() += reach;
    return box;
}

// One solid past one mesh; a moment is a share of the step.
template <class Solid>
class Sweep {
public:
    Sweep(const Mover<Solid>& mover, const MovingShape& mesh, const Vec3& shift, double reach,
          std::vector<Separation>& out)
        : mover_(mover), mesh_(mesh), shift_(shift), reach_(reach), field_(mesh.shape), out_(out) {}

    void run() {
        out_.clear();
        const Aabb box = box_of_way(mover_.center, shift_, mover_.farthest + reach_, mesh_.begin);
        const auto fastest = fastest_in(field_, mesh_.end_share, box);
        if (!fastest && sample(field_, mesh_.begin.inverse_apply(mover_.center)).distance >= 0) return;
        double moment = 0;  // deep inside no triangle is near
        const Manifold touch = first_touch(shift_.norm() + fastest.value_or(0), moment);
        if (touch.count == 0) return;
        const Vec3 offset = moment * shift_;
        Vec3 along = Vec3::Zero();  // way of the surface at the deepest point
        for (int k = 0; k < touch.count; ++k) {
            const Vec3 way = surface_way(touch.points[k].point_b);
            if (k == 0) along = way;
            const Separation s = before(touch.points[k], offset, moment * way);
            if (s.gap < std::max(-s.normal.dot(shift_ - way), 0.0) + reach_) out_.push_back(s);
        }
        slide(offset, along, moment);
    }

private:
    // Nothing if it passes; else what it touches, and when.
    Manifold first_touch(double speed, double& o_moment) {
        const double ahead = std::max(2 * reach_, 0.5 * mover_.nearest);  // how far points are looked for
        for (int k = 0;; ++k) {
            const Vec3 offset = o_moment * shift_;
            double gap = least_gap(offset, o_moment);
            const double seen = k < kMostAdvances ? ahead : std::max(ahead, (1 - o_moment) * speed + reach_);
            if (gap <= reach_ || k == kMostAdvances) {
                const Manifold touch = mover_.at(offset, field_, mesh_.begin, seen);
                gap = std::min(touch.least_gap(), seen);
                if (gap <= reach_ || k == kMostAdvances) return touch;
            }
            if (o_moment >= 1) return {};
            o_moment = speed > 0 ? std::min(1.0, o_moment + (gap - 0.5 * reach_) / speed) : 1;
        }
    }

    // The rest of the way, along with what was touched.
    void slide(Vec3 offset, const Vec3& along, double moment) {
        const Vec3 past = shift_ - along;
        const double way = past.norm(), stride = 0.5 * mover_.nearest;
        double left = (1 - moment) * way;
        for (int k = 0; k < kMostSlides && left > 0.2 * stride; ++k) {
            Vec3 direction = past / way;
            for (int pass = 0; pass < 2; ++pass)  // twice: the second of two planes may push back into the first
                for (const Separation& s : out_) direction -= std::min(s.normal.dot(direction), 0.0) * s.normal;
            if (direction.norm() < kHeld) return;
            const double step = std::min(left, stride);
            left -= step, moment = std::min(1.0, moment + step / way);
            offset += step * direction + step / way * along;
            if (least_gap(offset, moment) > reach_) continue;
            add_new(mover_.at(offset, field_, mesh_.begin, reach_), offset, moment);
        }
    }

    void add_new(const Manifold& further, const Vec3& offset, double moment) {
        const size_t known = out_.size();
        for (int j = 0; j < further.count; ++j) {
            const Separation& s = further.points[j];
            const bool is_known =
                std::any_of(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(known),
                            [&](const Separation& o) { return o.normal.dot(s.normal) > kSameNormal; });
            if (!is_known) out_.push_back(before(s, offset, moment * surface_way(s.point_b)));
        }
    }

    // A lower bound of its distance from the surface; from then on the field is that of the moment.
    double least_gap(const Vec3& offset, double moment) {
        field_ = field_.at(mesh_.shape.share + moment * (mesh_.end_share - mesh_.shape.share));
        return sample(field_, mesh_.begin.inverse_apply(mover_.center + offset)).distance - mover_.farthest;
    }

    // Over the step, of the point of the surface that is nearest; as the field stands.
    Vec3 surface_way(const Vec3& point) const {
        return (mesh_.end_share - mesh_.shape.share) *
               (mesh_.begin.orientation * way_at(field_, mesh_.begin.inverse_apply(point)));
    }

    // The same normal, the points where they begin.
    static Separation before(Separation s, const Vec3& offset, const Vec3& surface_offset) {
        s.point_a -= offset, s.point_b -= surface_offset;
        s.gap -= s.normal.dot(offset - surface_offset);
        return s;
    }

    const Mover<Solid>& mover_;
    const MovingShape& mesh_;
    const Vec3 shift_;
    const double reach_;
    SurfaceField field_;
    std::vector<Separation>& out_;
};

}  // namespace

PlacedShape at_end(const MovingShape& mesh) {
    PlacedShape placed{mesh.shape, mesh.begin};
    placed.shape.share = mesh.end_share;
    return placed;
}

void surface_contacts(const Ellipsoid& a, const MovingShape& mesh, const Vec3& shift, double reach,
                      std::vector<Separation>& out) {
    const Mover<Ellipsoid> mover{a, a.center, a.radii.maxCoeff(), a.radii.minCoeff()};
    Sweep(mover, mesh, shift, reach, out).run();
}

void surface_contacts(const PlacedShape& a, const MovingShape& mesh, const Vec3& shift, double reach,
                      std::vector<Separation>& out) {
    const double radius = bounding_radius(a.shape);
    const bool is_box = a.shape.kind == ShapeKind::box;
    const Mover<PlacedShape> mover{a, a.pose.position, radius, is_box ? a.shape.half_extents.minCoeff() : radius};
    Sweep(mover, mesh, shift, reach, out).run();
}

Vec3 surface_motion(const MovingShape& mesh, const Vec3& point) {
    const Vec3 local = mesh.begin.inverse_apply(point);
    const Vec3 way = (mesh.end_share - mesh.shape.share) * way_at(SurfaceField(mesh.shape), local);
    return mesh.end.apply(local + way) - point;
}

}  // namespace sunder
