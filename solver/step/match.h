// Shape matching and contacts, in turns.
#pragma once

#include "solver/matching/live_model.h"
#include "solver/pieces/contact_problem.h"
#include "solver/pieces/pieces.h"
#include "solver/step/matching.h"
#include "solver/step/second_order.h"
#include "solver/step/slice.h"

namespace sunder {

/// What shape matching is to leave alone: what is held, and what does not take the pass.
void leave_alone(const Pass& pass, const Movables& movables, Matching& io_matching);
/// The same of pieces; anew when edges broke.
void leave_pieces_alone(const Pass& pass, const LiveTopology& live, const Pieces& pieces, Matching& io_matching);

/// Towards the implicit Euler step, contacts before it and after each sweep: what is hit is matched where the push has
/// taken it, and not where it would fly to unhit. `smooth`: as StepPair's. Adds the times that it takes to the report.
void correct(const Pass& pass, std::span<const uint8_t> smooth, LiveModel& io_model, ContactProblem& io_problem,
             Matching& io_matching, Movables& io_movables, Pieces& io_pieces, StepReport& io_report);

}  // namespace sunder
