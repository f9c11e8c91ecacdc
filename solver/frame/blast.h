// Blasts: momentum that everything is given at once.
#pragma once

#include "solver/scene/local_force.h"
#include "solver/scene/step_context.h"

namespace sunder {

/// Of a blast's speed, what each particle and rigid body is given, and where to (n_movables). Nothing where pins hold
/// it and where something keeps the blast off.
std::vector<Vec3> shares_of(const StepContext& context, const Blast& blast, const FrameState& state);

/// Gives velocities what the input's blasts give, one after the other, to things where they are at the start of a
/// frame. Errors: something would be too fast to be simulated.
Status give_blasts(const StepContext& context, FrameState& io_state);

}  // namespace sunder
