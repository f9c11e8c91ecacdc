#include "solver/scene/curl_noise.h"

#include <cmath>

namespace sunder {
namespace {

// Root mean square of one octave's curl, measured over 10^6 places.
constexpr double kTypical = 1.223;

// Mixes all bits (Appleby's finalizer of MurmurHash3).
uint32_t mixed(uint32_t h) {
    h ^= h >> 16, h *= 0x85ebca6bu;
    h ^= h >> 13, h *= 0xc2b2ae35u;
    return h ^ h >> 16;
}

uint32_t hash_of_corner(const std::array<int64_t, 3>& corner, uint32_t seed) {
    uint32_t h = mixed(seed + 0x9e3779b9u);
    for (const int64_t c : corner) h = mixed(h ^ static_cast<uint32_t>(c)) + 0x9e3779b9u;
    return h;
}

// Three numbers of -1 .. 1 out of thirty bits.
Vec3 gradient(uint32_t hash) {
    const auto number = [](uint32_t ten_bits) { return (static_cast<double>(ten_bits & 1023u) - 511.5) / 511.5; };
    return {number(hash), number(hash >> 10), number(hash >> 20)};
}

double fade(double t) { return t * t * t * (t * (6 * t - 15) + 10); }
double slope_of_fade(double t) { return 30 * t * t * (t * (t - 2) + 1); }

// Curl of a vector of three gradient noises (Perlin 2002):
//   psi_k = sum over corners  w g_k . r,   w = prod fade(1 - |r_i|),  r = x - corner
Vec3 curl_of_noise(const Vec3& x, uint32_t seed) {
    const Vec3 low = x.array().floor();
    const std::array<int64_t, 3> first = {static_cast<int64_t>(low[0]), static_cast<int64_t>(low[1]),
                                          static_cast<int64_t>(low[2])};
    Mat3 slopes = Mat3::Zero();  // row k: gradient of psi_k
    for (int corner = 0; corner < 8; ++corner) {
        const std::array<int64_t, 3> at = {first[0] + (corner & 1), first[1] + (corner >> 1 & 1),
                                           first[2] + (corner >> 2 & 1)};
        Vec3 r = x - low, weight, slope;
        for (int i = 0; i < 3; ++i) {
            const bool upper = (corner >> i & 1) != 0;
            if (upper) r[i] -= 1;
            const double t = 1 - std::abs(r[i]);
            weight[i] = fade(t), slope[i] = upper ? slope_of_fade(t) : -slope_of_fade(t);
        }
        const Vec3 change(slope[0] * weight[1] * weight[2], weight[0] * slope[1] * weight[2],
                          weight[0] * weight[1] * slope[2]);
        uint32_t hash = hash_of_corner(at, seed);
        for (int k = 0; k < 3; ++k, hash = mixed(hash + 0x9e3779b9u)) {
            const Vec3 g = gradient(hash);
            slopes.row(k) += (change * g.dot(r) + weight.prod() * g).transpose();
        }
    }
    return {slopes(2, 1) - slopes(1, 2), slopes(0, 2) - slopes(2, 0), slopes(1, 0) - slopes(0, 1)};
}

}  // namespace

Vec3 curl_noise(const Vec3& x, double time, int octaves, uint32_t seed) {
    const double before = std::floor(time), late = fade(time - before), early = 1 - late;
    const auto moment = static_cast<uint32_t>(static_cast<int64_t>(before));
    // Farther out there are no fractions left that a noise could be of.
    const Vec3 place = x.cwiseMax(-1e12).cwiseMin(1e12);
    Vec3 sum = Vec3::Zero();
    double scale = 1, square = 0;
    for (int octave = 0; octave < octaves; ++octave, scale *= 2) {
        const uint32_t own = mixed(seed ^ mixed(static_cast<uint32_t>(octave) + 0x51ed270bu));
        Vec3 here = Vec3::Zero();
        if (early > 0) here += early * curl_of_noise(scale * place, own ^ mixed(moment));
        if (late > 0) here += late * curl_of_noise(scale * place, own ^ mixed(moment + 1));
        sum += here / scale, square += 1 / (scale * scale);
    }
    return sum / (kTypical * std::sqrt(square * (early * early + late * late)));
}

double noise_in_time(double time, uint32_t seed) {
    const double before = std::floor(time), late = fade(time - before);
    const auto at = [&](double moment) {
        const auto k = static_cast<uint32_t>(static_cast<int64_t>(moment));
        return static_cast<double>(mixed(mixed(seed + 0x9e3779b9u) ^ k)) / 2147483647.5 - 1;
    };
    return (1 - late) * at(before) + late * at(before + 1);
}

}  // namespace sunder
