// The weights of candidates at a visual vertex (skinning.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/data/math.h"

namespace sunder {

/// A particle's say at a vertex.
struct SkinInfluence {
    uint32_t particle;
    float weight;  // a multiple of 2^-24
};

/// A particle at rest, as the loop over candidates reads it.
struct alignas(32) ParticlePlace {
    double x, y, z;             // m
    double inv_square_support;  // 1 / r_j^2, 1/m2

    /// Farther away than any support reaches.
    static constexpr ParticlePlace nowhere() { return {1e200, 1e200, 1e200, 1}; }  // the square is infinite
};

/// Candidates are weighed that many at a time.
constexpr uint32_t kWeighed = 4;

/// Working memory of `weigh`, of one thread.
struct WeighScratch {
    std::vector<double> number;  // of each candidate: squared distance in supports, kernel
    std::vector<int32_t> parts;  // of each candidate: weight in parts of 2^24
};

/// Writes those of `candidates` that have a say at x, in their order, and gives their number. Their weights sum to one
/// exactly. `candidates` index `place`; their number is a multiple of kWeighed. `out` has room for all of them.
size_t weigh(const ParticlePlace* place, std::span<const uint32_t> candidates, const Vec3& x, WeighScratch& io_scratch,
             SkinInfluence* out);

}  // namespace sunder
