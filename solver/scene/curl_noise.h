// Smooth noise: the same numbers on every machine, of a seed alone.
#pragma once

#include <cstdint>

#include "solver/data/math.h"

namespace sunder {

/// Eddies of size 1 and, octave after octave, half as large and half as fast: a field without divergence (Bridson,
/// Houriham & Nordenstam 2007), whose root mean square is about 1. At whole numbers of `time` it is another one, and
/// blends in between.
Vec3 curl_noise(const Vec3& x, double time, int octaves, uint32_t seed);

/// -1 .. 1: any number at whole numbers of `time`, and smooth in between.
double noise_in_time(double time, uint32_t seed);

}  // namespace sunder
