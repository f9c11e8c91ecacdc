#include "fracture_tools/mesh/surface_uvs.h"

namespace sunder {

Color blended_color(const TriMesh& mesh, uint32_t triangle, const Vec3& weights) {
    Color color;
    for (size_t k = 0; k < color.size(); ++k) {
        double sum = 0;
        for (int m = 0; m < 3; ++m) sum += weights[m] * double(mesh.corner_colors[3 * triangle + m][k]);
        color[k] = float(sum);
    }
    return color;
}

Vec2f SourceUvs::at(const Vec3& p, const Vec3& middle, uint32_t home) const {
    const Vec2f extended = in_plane_of(home, p);
    const SurfacePoint near = lookup_.nearest(p + 0.01 * (middle - p));  // from edges a little into the own face
    const Vec2f exact = blend(near.triangle, near.barycentric);
    const float spread = (extended - in_plane_of(home, middle)).norm();
    return (exact - extended).norm() <= 1.5f * spread ? exact : extended;
}

Vec2f SourceUvs::blend(uint32_t t, const Vec3& weights) const {
    Vec2f uv = Vec2f::Zero();
    for (int c = 0; c < 3; ++c) uv += float(weights[c]) * source_.corner_uvs[3 * t + c];
    return uv;
}

/// Barycentric coordinates of the foot of p on the plane of t, which may be outside of t.
Vec2f SourceUvs::in_plane_of(uint32_t t, const Vec3& p) const {
    const Vec3 &a = source_.positions[source_.triangles[t][0]], &b = source_.positions[source_.triangles[t][1]],
               &c = source_.positions[source_.triangles[t][2]];
    const Vec3 n = (b - a).cross(c - a);
    if (n.squaredNorm() == 0) return source_.corner_uvs[3 * t];
    const double v = (p - a).cross(c - a).dot(n) / n.squaredNorm(), w = (b - a).cross(p - a).dot(n) / n.squaredNorm();
    return blend(t, Vec3(1 - v - w, v, w));
}

}  // namespace sunder
