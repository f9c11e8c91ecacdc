// A solid past a mesh that is known by its distances and may deform meanwhile: when they touch, and all that they may.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "solver/collision/first_touch.h"
#include "solver/collision/grid_distance.h"

namespace sunder {

/// An ellipsoid, or a rigid sphere or box: where it is at the begin, and how to ask what it touches elsewhere.
template <class Solid>
struct Mover {
    const Solid& solid;
    Vec3 center;
    double farthest, nearest;  // of its surface from there, m

    template <class Field>
    Manifold at(const Vec3& offset, const Field& field, const Pose& pose, double within) const;
};

inline Mover<Ellipsoid> mover_of(const Ellipsoid& a) { return {a, a.center, a.radii.maxCoeff(), a.radii.minCoeff()}; }
inline Mover<PlacedShape> mover_of(const PlacedShape& a) {
    const double radius = bounding_radius(a.shape);
    const bool is_box = a.shape.kind == ShapeKind::box;
    return {a, a.pose.position, radius, is_box ? a.shape.half_extents.minCoeff() : radius};
}

template <>
template <class Field>
Manifold Mover<Ellipsoid>::at(const Vec3& offset, const Field& field, const Pose& pose, double within) const {
    Ellipsoid moved = solid;
    moved.center += offset;
    const Manifold all = ellipsoid_grid_contacts(moved, field, pose);
    Manifold m;
    for (int k = 0; k < all.count; ++k)
        if (all.points[k].gap < within) m.add(all.points[k]);
    return m;
}

template <>
template <class Field>
Manifold Mover<PlacedShape>::at(const Vec3& offset, const Field& field, const Pose& pose, double within) const {
    PlacedShape moved = solid;
    moved.pose.position += offset;
    return rigid_grid_contacts(moved, field, pose, within);
}

/// One solid past one mesh. Solid and surface are advanced together by no more than the distance between them, so that
/// no wall passes that the distances tell of; after the first touch the rest of the way is followed along with what was
/// touched, in steps of half the solid's least radius, eight at most: what stands in a corner is found too. Contacts
/// are as before the move, with the normals of their moment.
///
/// `Mesh` says what is passed, by a progress that runs from 0 to `end()`:
///   const Pose& pose() const;              its frame, in which distances are
///   const Field& at(double progress);      distances as they are then; they stand until the next call
///   Vec3 offset(double progress) const;    of the solid, m
///   double after(double progress, double gap, double reach) const;  so that a gap (m) closes to half the reach at most
///   double later(double progress, double share) const;    by a share of all of it
///   double room_left(double progress) const;              what they come nearer by from then on, at most, m
///   double way_left(double progress, double way) const;   of a way (m) over all of it
///   Vec3 surface_way(const Vec3& point) const;            of the surface nearest to a point over all of it, m
///   Vec3 part_of(const Vec3& surface_way, double progress) const;  up to then
///   static constexpr bool kSeesRest;                      a way that grazes on for long ends with all that it may meet
///   static constexpr double kAhead;                       points are looked for so many reaches ahead, or more
template <class Solid, class Mesh>
class SolidSweep {
public:
    /// `reach` (> 0, m): how near counts.
    SolidSweep(const Mover<Solid>& mover, Mesh& mesh, const Vec3& shift, double reach, std::vector<Separation>& out)
        : mover_(mover), mesh_(mesh), shift_(shift), reach_(reach), out_(out) {}

    void run() {
        double progress = 0;
        const std::optional<Manifold> found = first_touch(progress);
        if (!found) return;
        const Manifold& touch = *found;
        const Vec3 offset = mesh_.offset(progress);
        Vec3 along = Vec3::Zero();  // way of the surface at the deepest point
        for (int k = 0; k < touch.count; ++k) {
            const Vec3 way = mesh_.surface_way(touch.points[k].point_b);
            if (k == 0) along = way;
            // A point counts if the whole way would close it; only those of the touch do.
            const Separation s = before(touch.points[k], offset, mesh_.part_of(way, progress));
            if (s.gap < std::max(-s.normal.dot(shift_ - way), 0.0) + reach_) out_.push_back(s);
        }
        slide(offset, along, progress);
    }

private:
    static constexpr int kMostAdvances = 64;  // grazing ways advance slowly; past it what is known counts
    static constexpr int kMostSlides = 8;
    static constexpr double kHeld = 0.2;  // of a way, the part that is left where others hold it from all sides

    // Nothing if it passes; else what it touches, and when.
    std::optional<Manifold> first_touch(double& o_progress) {
        const double ahead = std::max(Mesh::kAhead * reach_, 0.5 * mover_.nearest);
        Manifold touch;
        for (int k = 0;; ++k) {
            const Vec3 offset = mesh_.offset(o_progress);
            const auto& field = mesh_.at(o_progress);
            const bool is_last = k == kMostAdvances, sees_rest = is_last && Mesh::kSeesRest;
            double gap = least_gap(field, offset);
            if (gap <= reach_ || sees_rest) {
                const double seen = sees_rest ? std::max(ahead, mesh_.room_left(o_progress) + reach_) : ahead;
                touch = mover_.at(offset, field, mesh_.pose(), seen);
                gap = std::min(touch.least_gap(), seen);
            }
            if (gap <= reach_ || (is_last && touch.count > 0)) return touch;
            if (is_last || o_progress >= mesh_.end()) return {};
            o_progress = mesh_.after(o_progress, gap, reach_);
        }
    }

    // The rest of the way, along with what was touched.
    void slide(Vec3 offset, const Vec3& along, double progress) {
        const Vec3 past = shift_ - along;
        const double way = past.norm(), stride = 0.5 * mover_.nearest;
        double left = mesh_.way_left(progress, way);
        for (int k = 0; k < kMostSlides && left > 0.2 * stride; ++k) {
            Vec3 direction = past / way;
            for (int pass = 0; pass < 2; ++pass)  // twice: the second of two planes may push back into the first
                for (const Separation& s : out_) direction -= std::min(s.normal.dot(direction), 0.0) * s.normal;
            if (direction.norm() < kHeld) return;
            const double step = std::min(left, stride);
            left -= step, progress = mesh_.later(progress, step / way);
            offset += step * direction + step / way * along;
            const auto& field = mesh_.at(progress);
            if (least_gap(field, offset) > reach_) continue;
            add_new(mover_.at(offset, field, mesh_.pose(), reach_), offset, progress);
        }
    }

    void add_new(const Manifold& further, const Vec3& offset, double progress) {
        const size_t known = out_.size();
        for (int j = 0; j < further.count; ++j) {
            const Separation& s = further.points[j];
            const bool is_known =
                std::any_of(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(known),
                            [&](const Separation& o) { return o.normal.dot(s.normal) > kSameNormal; });
            if (!is_known) out_.push_back(before(s, offset, mesh_.part_of(mesh_.surface_way(s.point_b), progress)));
        }
    }

    // A lower bound of its distance from the surface.
    template <class Field>
    double least_gap(const Field& field, const Vec3& offset) const {
        return sample(field, mesh_.pose().inverse_apply(mover_.center + offset)).distance - mover_.farthest;
    }

    // The same normal, the points where they begin.
    static Separation before(Separation s, const Vec3& offset, const Vec3& surface_offset) {
        s.point_a -= offset, s.point_b -= surface_offset;
        s.gap -= s.normal.dot(offset - surface_offset);
        return s;
    }

    const Mover<Solid>& mover_;
    Mesh& mesh_;
    const Vec3 shift_;
    const double reach_;
    std::vector<Separation>& out_;
};

}  // namespace sunder
