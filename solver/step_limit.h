// A bound on how far one Newton step may go.
#pragma once

#include <span>

#include "solver/matching/shape_matching.h"
#include "solver/scene/live_topology.h"

namespace sunder {

/// Where a particle was before a Newton step.
struct StepStart {
    Vec3 x;
    Quat d;
};

/// Shortens the step of every piece in which a particle turned by more than kMostTurn (0.3 rad), all of the piece
/// alike. The step's linear system holds goal rotations fixed; a fragment on a hinge, pulled by a stiff group, may be
/// told to turn by radians, where the energy is another one: it then arrives upside down with more energy than all of
/// the scene had. The steps that follow make up for what was left out. `before`: the particles before the step;
/// `cosine`: of half of each one's turn.
void limit_step(const LiveTopology& live, std::span<const StepStart> before, std::span<const double> cosine,
                size_t begin_piece, size_t end_piece, std::span<MovingParticle> io_particles);

}  // namespace sunder
