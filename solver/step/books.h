// The end of a step: velocities from where things came to, momentum, and the state.
#pragma once

#include "solver/matching/live_model.h"
#include "solver/pieces/contact_problem.h"
#include "solver/pieces/pieces.h"
#include "solver/step/second_order.h"

namespace sunder {

/// Velocities and inertia where things came to, and positions into the state.
Status take_up_motion(const StepContext& context, const GroupShapes& shapes, const Pieces& pieces,
                      Movables& io_movables, FrameState& io_state);

/// Each free piece gets the angular momentum that it had, plus what contacts gave it.
void restore_momentum(const StepContext& context, double h, const LiveModel& model, const FrameState& state,
                      Pieces& io_pieces, Movables& io_movables);

/// Velocities of what touches, and what lasts of the contacts' forces.
void settle_contacts(const StepContext& context, double h, const LiveTopology& live, const ContactProblem& problem,
                     Pieces& io_pieces, Movables& io_movables, FrameState& io_state);

/// Leaves a first step's things in the middle of their pair. Writes the state.
Status store(const StepContext& context, const StepTime& time, std::span<const GroupGoal> goals, const Pieces& pieces,
             StepPair& io_pair, Movables& io_movables, FrameState& io_state);

}  // namespace sunder
