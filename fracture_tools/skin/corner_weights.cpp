#include "fracture_tools/skin/corner_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fracture_tools/skin/vector_clones.h"

namespace sunder {
namespace {

constexpr size_t kBatch = 16;  // triangles side by side in registers

// atan2(y, x) for y >= 0 without branches: Abramowitz & Stegun 4.4.49, 2e-8 on [0, 1], and the symmetries.
inline __attribute__((always_inline)) float angle_of(float y, float x) {
    constexpr float kPi = std::numbers::pi_v<float>;
    const float ax = x < 0 ? -x : x;
    const float low = y < ax ? y : ax, high = y < ax ? ax : y;
    const float t = low / (high > std::numeric_limits<float>::min() ? high : std::numeric_limits<float>::min());
    const float s = t * t;
    float p = 0.0028662257f;
    p = p * s - 0.0161657367f;
    p = p * s + 0.0429096138f;
    p = p * s - 0.0752896400f;
    p = p * s + 0.1065626393f;
    p = p * s - 0.1420889944f;
    p = p * s + 0.1999355085f;
    p = p * s - 0.3333314528f;
    p = p * s + 1.0f;
    const float small = p * t, octant = y < ax ? small : kPi / 2 - small;
    return x < 0 ? kPi - octant : octant;
}

}  // namespace

SUNDER_VECTOR_CLONES void weigh_corners(std::span<const Triangle> triangles, std::span<const uint32_t> face,
                                        std::span<const uint8_t> silent, std::span<const Vec3> positions, size_t begin,
                                        size_t end, uint32_t first_face, CornerWeights* out) {
    double ab[3][kBatch], ac[3][kBatch];
    float normal[3][kBatch], angle[3][kBatch];
    for (size_t first = begin; first < end; first += kBatch) {
        const size_t n = std::min(kBatch, end - first);
        for (size_t i = 0; i < n; ++i) {
            const Triangle& t = triangles[first + i];
            const double *a = positions[t[0]].data(), *b = positions[t[1]].data(), *c = positions[t[2]].data();
            for (int k = 0; k < 3; ++k) ab[k][i] = b[k] - a[k], ac[k][i] = c[k] - a[k];
        }
        for (size_t i = n; i < kBatch; ++i)
            for (int k = 0; k < 3; ++k) ab[k][i] = ac[k][i] = 0;
        for (size_t i = 0; i < kBatch; ++i) {
            const double nx = ab[1][i] * ac[2][i] - ab[2][i] * ac[1][i], ny = ab[2][i] * ac[0][i] - ab[0][i] * ac[2][i],
                         nz = ab[0][i] * ac[1][i] - ab[1][i] * ac[0][i];
            const double ab_ab = ab[0][i] * ab[0][i] + ab[1][i] * ab[1][i] + ab[2][i] * ab[2][i];
            const double ac_ac = ac[0][i] * ac[0][i] + ac[1][i] * ac[1][i] + ac[2][i] * ac[2][i];
            const double ab_ac = ab[0][i] * ac[0][i] + ab[1][i] * ac[1][i] + ab[2][i] * ac[2][i];
            const double bc_bc = ab_ab + ac_ac - 2 * ab_ac;
            const double two = ab_ab > ac_ac ? ab_ab : ac_ac, longest = two > bc_bc ? two : bc_bc;
            const double twice_area = std::sqrt(nx * nx + ny * ny + nz * nz);
            const bool says = twice_area > kSliver * longest;
            const double scale = (says ? 1.0 : 0.0) / (says ? twice_area : 1.0);
            normal[0][i] = static_cast<float>(nx * scale);
            normal[1][i] = static_cast<float>(ny * scale);
            normal[2][i] = static_cast<float>(nz * scale);
            // Relative to the longest edge, so that no size of mesh leaves the range of a float.
            const double unit = 1 / (longest > 0 ? longest : 1.0);
            const float y = static_cast<float>(twice_area * unit);
            angle[0][i] = angle_of(y, static_cast<float>(ab_ac * unit));
            angle[1][i] = angle_of(y, static_cast<float>((ab_ab - ab_ac) * unit));
            angle[2][i] = std::numbers::pi_v<float> - angle[0][i] - angle[1][i];
        }
        for (size_t i = 0; i < n; ++i) {
            const uint32_t f = face[first + i];
            CornerWeights& w = out[f - first_face];
            w.normal = {normal[0][i], normal[1][i], normal[2][i]}, w.angle = {angle[0][i], angle[1][i], angle[2][i]};
            if (silent[f]) w = {};
        }
    }
}

}  // namespace sunder
