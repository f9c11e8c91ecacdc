// The elastic energy of one group (docs/theory.md, "Elasticity"), for the books of what breaks.
#pragma once

#include <span>

#include "solver/matching/live_model.h"

namespace sunder {

/// J. `start`: a rotation near the group's.
double group_energy(const LiveModel& model, std::span<const MovingParticle> particles, const Quat& start,
                    ParticleIndex group);

}  // namespace sunder
