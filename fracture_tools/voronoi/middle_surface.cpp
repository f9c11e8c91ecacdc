#include "fracture_tools/voronoi/middle_surface.h"

#include <algorithm>

namespace sunder {
namespace {

/// Faces look away from each other where their normals have less than this cosine.
constexpr double kOpposite = -0.5;
/// A ball is as small as it gets where it shrinks by less than this share; most take fewer than six steps.
constexpr double kStill = 1e-6;
constexpr int kMostSteps = 40;

}  // namespace

MiddleSurface::MiddleSurface(MeshView solid) : solid_(solid), surface_(solid) {
    Aabb box;
    for (const Vec3& p : solid.positions) box.extend(p);
    diagonal_ = box.diagonal();
}

Vec3 MiddleSurface::normal(uint32_t triangle) const {
    const auto& [a, b, c] = solid_.triangles[triangle];
    const Vec3& at = solid_.positions[a];
    return (solid_.positions[b] - at).cross(solid_.positions[c] - at).stableNormalized();
}

std::optional<MiddleSurface::Place> MiddleSurface::at(const Vec3& p, double most) const {
    if (const auto place = between_faces(p, most)) return place;
    // By a rim, as far from the middle as it is deeper within the solid.
    const SurfacePoint near = surface_.nearest(p);
    const Vec3 inside = near.position - 0.5 * most * normal(near.triangle);
    auto place = between_faces(inside, most);
    if (place) place->position += p - inside;
    return place;
}

std::optional<MiddleSurface::Place> MiddleSurface::between_faces(const Vec3& p, double most) const {
    const SurfacePoint first = surface_.nearest(p);
    const Vec3 outward = normal(first.triangle), way = p - first.position;
    // Rounding decides of a point on the surface whether it lies inside.
    const bool is_inside = way.dot(outward) < -1e-9 * diagonal_;
    const Vec3 inward = is_inside ? Vec3(way / first.distance) : Vec3(-outward);
    double radius = 0.5 * most;
    uint32_t opposite = first.triangle;
    for (int step = 0; step < kMostSteps; ++step) {
        const SurfacePoint touched = surface_.nearest(first.position + radius * inward);
        const Vec3 chord = touched.position - first.position;
        const double rise = chord.dot(inward);
        if (!(touched.distance < radius * (1 - kStill)) || !(rise > 0)) break;
        radius = std::min(radius, chord.squaredNorm() / (2 * rise));
        opposite = touched.triangle;
    }
    if (!(normal(opposite).dot(outward) < kOpposite)) return std::nullopt;
    return Place{first.position + radius * inward, 2 * radius};
}

}  // namespace sunder
