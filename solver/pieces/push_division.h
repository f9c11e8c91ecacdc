// How a push on a particle divides between it and its piece.
#pragma once

#include "solver/matching/live_model.h"
#include "solver/pieces/contact_problem.h"
#include "solver/pieces/pieces.h"

namespace sunder {

/// Fills `own_share` of the free pieces of an island of contacts, and `held_share` of the particles of those that pins
/// hold. A push on a bound particle in an implicit step moves the particle by (H^-1)_jj, which lies between
/// 1/(m_j (1 + sum_g b_g)), were its neighbours held, and 1/m_j, were they absent. A particle that is pushed together
/// with those beside it, as where bodies lie on one another, gives more than alone: a load on a face moves all that
/// waves of speed c reach in the step, d / (c h) of 1/m_j, and no more than the piece is thick. Contacts that took less
/// would push harder than what they carry weighs, and a stack would throw itself off. Before another sweep of shape
/// matching the upper bound is taken for free pieces with broken edges: the sweep finds the true motion, and a contact
/// that took less would have pushed too hard (a fragment on a hinge gives like a free one). Of held ones that is so of
/// thin fragments alone. What else bears a press would go as if nothing held it, the sweep would take it back whole,
/// and what the last round then held it with, a thousand times as much, would throw it in the next step. After the last
/// sweep nothing would mend the strain that pushes make in stiff bodies, so there a particle moves by little more than
/// the lower bound and its piece as a whole by the rest; contacts within a piece, which no motion of the whole can
/// part, are left as the sweep found them.
void divide_pushes(const StepContext& context, double h, bool last, const LiveModel& model,
                   const ContactProblem& problem, IslandId island, Pieces& io_pieces);

}  // namespace sunder
