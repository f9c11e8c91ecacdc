// What stands on something soft, and something soft that lies on what does not give, are matched together; so is what
// is driven into something soft that pins hold.
//
// Rounds over contacts and Newton steps take turns, and neither sees the other's inertia: what carries a weight springs
// back as if it carried none, and the round that follows lifts the weight by all that it had sunk in. So a weight sank
// by up to half too far, or not at all, as the substep had it, and trembled; where a Newton step was all of the
// substep what was ten times as heavy as a plank was thrown off it.
#pragma once

#include <span>

#include "solver/matching/live_model.h"
#include "solver/pieces/contact_problem.h"
#include "solver/pieces/movables.h"
#include "solver/pieces/pieces.h"
#include "solver/scene/step_context.h"

namespace sunder {

/// Before the first round, where Newton steps are taken: how the loads of an island stand, and what its contacts start
/// from then; its first round is left with that. Some piece must give and none hang on hinges. Where something was
/// carried at the end of the last substep and nothing closes faster than what fell by half of the smallest fragment
/// loads of a single piece that gives are taken together; also the rounds between Newton steps are left with what they
/// are given then. What is driven into a single piece that gives and that pins hold, in any way and at any speed, is
/// taken together with it as well, between rounds as ever; what does not bounce from where it may first touch, else
/// from where it touched in the last substep, and it does not bounce any more. Several that give take four Newton steps
/// at least, with a round between each two; so does what is crushed, which closes faster as it trembles. Else forces
/// are kept where nothing closes faster than what lies still and another round comes before the last: what gives pushes
/// back by how it is bent, which no round knows of before shape matching, and would take the load from it. `strain`:
/// FrameState::strain.
void find_standing_loads(const StepContext& context, double h, std::span<const double> strain, const LiveModel& model,
                         const ContactBodies& bodies, IslandId island, ContactProblem& io_problem);

/// After a round that shape matching follows, where loads stand: what bears them is braced with their masses, shared
/// out as they press on it, and begins where the ground is.
void brace_bearers(const StepContext& context, double h, bool first, const LiveModel& model, IslandId island,
                   const Pieces& pieces, ContactProblem& io_problem, Movables& io_movables);

/// After shape matching, before pieces get back their momentum: what the masses resisted with is what these contacts
/// push. It goes to both sides, as far as something is pushed and friction holds, so that nothing is lost.
void pass_loads_on(const SimulationMesh& rest, const LiveTopology& live, IslandId island, ContactProblem& io_problem,
                   Movables& io_movables, Pieces& io_pieces);

}  // namespace sunder
