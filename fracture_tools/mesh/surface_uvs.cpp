#include "fracture_tools/mesh/surface_uvs.h"

#include <algorithm>
#include <cmath>

#include "fracture_tools/mesh/mesh_rows.h"

namespace sunder {
namespace {

using Row = std::array<float, LayerId::kWidest>;

/// Of a point in the plane of a triangle, whose corners' rows of `n` floats begin at `rows`.
Row in_plane(const float* rows, size_t n, const std::optional<Vec3>& weights) {
    Row out{};
    if (!weights) {
        std::copy_n(rows, n, out.begin());
        return out;
    }
    for (size_t k = 0; k < n; ++k)
        for (size_t c = 0; c < 3; ++c) out[k] += float((*weights)[Eigen::Index(c)]) * rows[c * n + k];
    return out;
}

float distance(const Row& a, const Row& b, size_t n) {
    float sum = 0;
    for (size_t k = 0; k < n; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return std::sqrt(sum);
}

/// Barycentric coordinates of the foot of p on the plane of a triangle, which may be outside of it.
std::optional<Vec3> plane_weights(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
    const Vec3 n = (b - a).cross(c - a);
    if (n.squaredNorm() == 0) return std::nullopt;
    const double v = (p - a).cross(c - a).dot(n) / n.squaredNorm(), w = (b - a).cross(p - a).dot(n) / n.squaredNorm();
    return Vec3(1 - v - w, v, w);
}

}  // namespace

SourceCorners::Place SourceCorners::place(const Vec3& p, const Vec3& middle, uint32_t home) const {
    const Vec3 &a = source_.positions[source_.triangles[home][0]], &b = source_.positions[source_.triangles[home][1]],
               &c = source_.positions[source_.triangles[home][2]];
    return {home, lookup_.nearest(p + 0.01 * (middle - p)), plane_weights(a, b, c, p), plane_weights(a, b, c, middle),
            nearest_on_triangle(p, a, b, c).barycentric};
}

bool SourceCorners::is_beyond_seam(const Place& at, const float* corners, size_t n, float* out_exact,
                                   float* out_extended) const {
    const float* home = corners + 3 * size_t{at.home} * n;
    const Row extended = in_plane(home, n, at.at_corner);
    const Row exact = in_plane(corners + 3 * size_t{at.near.triangle} * n, n, at.near.barycentric);
    const float spread = distance(extended, in_plane(home, n, at.at_middle), n);
    std::copy_n(exact.begin(), n, out_exact);
    std::copy_n(extended.begin(), n, out_extended);
    return !(distance(exact, extended, n) <= 1.5f * spread);
}

Vec2f SourceCorners::uvs(const Place& at) const {
    Vec2f exact, extended;
    return is_beyond_seam(at, source_.corner_uvs.data()->data(), 2, exact.data(), extended.data()) ? extended : exact;
}

void SourceCorners::append(const Place& at, const MeshLayer& layer, std::vector<float>& io_values) const {
    if (!layer.is_blended()) return append_at(source_, layer, at.home, at.held, io_values);
    Row exact, extended;
    const bool is_beyond = is_beyond_seam(at, layer.values.data(), layer.width, exact.data(), extended.data());
    if (layer.kind != LayerKind::uv)
        return is_beyond ? append_at(source_, layer, at.home, at.held, io_values)
                         : append_at(source_, layer, at.near.triangle, at.near.barycentric, io_values);
    const Row& found = is_beyond ? extended : exact;
    io_values.insert(io_values.end(), found.begin(), found.begin() + layer.width);
}

}  // namespace sunder
