// Smooth random vectors in space.
#pragma once

#include "solver/data/math.h"

namespace sunder {

/// Gradient noise (Perlin 2002) in each component: two octaves, within [-1, 1], 0 in the mean, bumps about 1 apart.
Vec3 solid_noise(const Vec3& p, uint32_t seed);

}  // namespace sunder
