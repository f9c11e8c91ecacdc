#include "fracture_tools/fragments/solid_noise.h"

#include <algorithm>
#include <cmath>

namespace sunder {
namespace {

uint64_t mixed(uint64_t h) {  // splitmix64
    h += 0x9e3779b97f4a7c15ull;
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
    return h ^ (h >> 31);
}

double gradient(int64_t x, int64_t y, int64_t z, uint64_t seed, const Vec3& d) {
    const uint64_t h = mixed(mixed(mixed(mixed(seed) ^ uint64_t(x)) ^ uint64_t(y)) ^ uint64_t(z));
    // Towards the twelve edges of a cube.
    const double u = (h & 8) ? d.y() : d.x(), v = (h & 8) ? d.z() : ((h & 4) ? d.y() : d.z());
    return ((h & 1) ? -u : u) + ((h & 2) ? -v : v);
}

double fade(double t) { return t * t * t * (t * (6 * t - 15) + 10); }

double octave(const Vec3& p, uint64_t seed) {
    const Vec3 floor = p.array().floor(), d = p - floor;
    double value = 0;
    for (int k = 0; k < 8; ++k) {
        const Vec3 corner(k & 1, (k >> 1) & 1, k >> 2);
        double weight = 1;
        for (int i = 0; i < 3; ++i) weight *= corner[i] == 1 ? fade(d[i]) : 1 - fade(d[i]);
        const Vec3 at = floor + corner;
        value += weight * gradient(int64_t(at.x()), int64_t(at.y()), int64_t(at.z()), seed, d - corner);
    }
    return value;
}

}  // namespace

Vec3 solid_noise(const Vec3& p, uint32_t seed) {
    Vec3 n;
    for (uint64_t i = 0; i < 3; ++i) {
        const uint64_t own = 8 * uint64_t{seed} + 2 * i;
        n[int(i)] = std::clamp(octave(p, own) + 0.5 * octave(2 * p, own + 1), -1.0, 1.0);
    }
    return n;
}

}  // namespace sunder
