// How quietly and how soundly things lie at the end of a run: a solver is not fast that leaves its work undone.
#pragma once

#include <span>

#include "solver/solver.h"

namespace sunder::bench {

struct Lying {
    double speed_p50 = 0, speed_p90 = 0;  // of particles over the last frame: median and 90th percentile, m/s
    double below_floor = 0;               // how far the lowest point of a hull is below z = 0, m; 0 without a floor
};

/// `before`, `now`: positions a frame apart; `orientation` as in a state. The scene's first collider may be a floor.
Lying how_things_lie(const Solver& solver, double frame_seconds, std::span<const Vec3> before,
                     std::span<const Vec3> now, std::span<const Quat> orientation);

}  // namespace sunder::bench
