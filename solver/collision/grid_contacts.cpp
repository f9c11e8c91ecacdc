#include "solver/collision/grid_contacts.h"

#include <algorithm>
#include <cmath>

#include "solver/collision/first_touch.h"
#include "solver/collision/grid_distance.h"

namespace sunder {
namespace {

/// `lower_bound(offset)`: cheap, of the distance; `at(offset, within)`: all points whose gap is below `within`.
template <class LowerBound, class ManifoldAt>
void swept_contacts(const LowerBound& lower_bound, const ManifoldAt& at, const Vec3& shift, double reach,
                    double least_radius, std::vector<Separation>& out) {
    constexpr int kMostAdvances = 64;  // grazing paths advance slowly; past it the surface as it stands is kept: safe
    out.clear();
    const double way = shift.norm();
    const double seen = std::max(reach, 0.5 * least_radius);  // how far ahead points are looked for
    double travelled = 0;
    Manifold touch;
    for (int k = 0;; ++k) {
        const Vec3 offset = way > 0 ? Vec3(travelled / way * shift) : Vec3(Vec3::Zero());
        double gap = lower_bound(offset);
        if (gap <= reach) {
            touch = at(offset, seen);
            gap = std::min(touch.least_gap(), seen);
        }
        if (gap <= reach || (k == kMostAdvances && touch.count > 0)) break;
        if (travelled >= way || k == kMostAdvances) return;
        travelled = std::min(way, travelled + gap - 0.5 * reach);
    }
    // A point counts if the whole way would close it; only those of the touch do.
    const auto add = [&](const Separation& touched, const Vec3& offset) {
        const Separation s = moved_back(touched, offset);
        if (s.gap < std::max(-s.normal.dot(shift), 0.0) + reach) out.push_back(s);
    };
    Vec3 offset = way > 0 ? Vec3(travelled / way * shift) : Vec3(Vec3::Zero());
    for (int k = 0; k < touch.count; ++k) add(touch.points[k], offset);

    constexpr int kMostSlides = 8;
    double left = way - travelled;
    const double stride = 0.5 * least_radius;
    for (int k = 0; k < kMostSlides && left > 0.2 * stride; ++k) {
        Vec3 slide = shift / way;
        for (int pass = 0; pass < 2; ++pass)  // twice: the second of two planes may push back into the first
            for (const Separation& s : out) slide -= std::min(s.normal.dot(slide), 0.0) * s.normal;
        if (slide.norm() < 0.2) return;  // held from all sides that the way leads to
        const double step = std::min(left, stride);
        left -= step;
        offset += step * slide;
        if (lower_bound(offset) > reach) continue;
        const Manifold further = at(offset, reach);
        const size_t known = out.size();
        for (int j = 0; j < further.count; ++j) {
            const Separation& s = further.points[j];
            const bool is_known =
                std::any_of(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(known),
                            [&](const Separation& o) { return o.normal.dot(s.normal) > kSameNormal; });
            if (!is_known) out.push_back(moved_back(s, offset));
        }
    }
}

double center_distance(const Vec3& center, const PlacedShape& mesh) {
    return sample(*mesh.shape.grid, mesh.pose.inverse_apply(center)).distance;
}

}  // namespace

void grid_contacts(const Ellipsoid& a, const PlacedShape& mesh, const Vec3& shift, double reach,
                   std::vector<Separation>& out) {
    const double radius = a.radii.maxCoeff();
    Ellipsoid moved = a;
    swept_contacts([&](const Vec3& offset) { return center_distance(a.center + offset, mesh) - radius; },
                   [&](const Vec3& offset, double within) {
                       moved.center = a.center + offset;
                       Manifold m;
                       const Manifold all = ellipsoid_grid_contacts(moved, *mesh.shape.grid, mesh.pose);
                       for (int k = 0; k < all.count; ++k)
                           if (all.points[k].gap < within) m.add(all.points[k]);
                       return m;
                   },
                   shift, reach, a.radii.minCoeff(), out);
}

void grid_contacts(const PlacedShape& a, const PlacedShape& mesh, const Vec3& shift, double reach,
                   std::vector<Separation>& out) {
    const bool is_box = a.shape.kind == ShapeKind::box;
    const double radius = bounding_radius(a.shape);
    PlacedShape moved = a;
    swept_contacts([&](const Vec3& offset) { return center_distance(a.pose.position + offset, mesh) - radius; },
                   [&](const Vec3& offset, double within) {
                       moved.pose.position = a.pose.position + offset;
                       return rigid_grid_contacts(moved, *mesh.shape.grid, mesh.pose, within);
                   },
                   shift, reach, is_box ? a.shape.half_extents.minCoeff() : radius, out);
}

}  // namespace sunder
