// Cells gathered into clusters of like size (Choi 2014, section 4: k-means over tetrahedra).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solver/data/math.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"

namespace sunder {

/// Volume-weighted k-means: k-means++ seeding (Arthur & Vassilvitskii 2007) from `seed`, then Lloyd's iteration until
/// fewer than one cell in a thousand changes its cluster. Gives the cluster of each point, 0 .. n_clusters - 1; with
/// points that coincide clusters may stay empty. Deterministic for one seed on every machine: it draws from the 64-bit
/// Mersenne twister directly; same bits for any number of threads (0: all cores). Needs 1 <= n_clusters <= points.
/// Error: cancelled.
Result<std::vector<uint32_t>> kmeans_clusters(std::span<const Vec3> points, std::span<const double> weights,
                                              uint32_t n_clusters, uint64_t seed, int threads,
                                              const Progress& progress = {});

}  // namespace sunder
