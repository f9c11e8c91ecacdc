// Hits: into how many parts a step is divided for one, and for what.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solver/matching/live_model.h"
#include "solver/pieces/contact_problem.h"
#include "solver/pieces/pieces.h"
#include "solver/step/slice.h"

namespace sunder {

struct Hit {
    int parts = 1;              // of the step, that it asks for; 1: there is none
    std::vector<uint8_t> what;  // takes them: all that hangs together with a hit or is near (n_movables)
};

/// Whether steps are taken in parts at all.
bool divides_hits(const SolverSettings& settings);

/// What is hit at speed v strains by v / c where the waves of the hit, of speed c, have come; an implicit step spreads
/// that over all that they reach in it, so that nothing breaks of a strain that is many times the toughness. Hence
/// where something closes fast enough to break what it meets, or such waves run through what is pushed, the step is to
/// be taken in parts in which they go from particle to particle, by all that hangs together with it. Of two particles
/// that meet, the lighter one takes most of v. Not by sweeps: what stiffness they leave depends on the step, and what a
/// long one bent a short one lets go.
Hit find_hits(const Pass& pass, const LiveModel& model, const ContactProblem& problem, const Movables& movables,
              const Pieces& pieces);

/// A crack runs at nearly the speed of waves, by what they bring to its tip; a step over which they run far lets it go
/// no further than the load at rest takes it. Hence the step in which edges that fade break is to be taken in such
/// parts, by all that hangs together with them, if steps are divided at all (divides_hits); where hit_substeps are too
/// few for that, in none, for fewer show nothing of it. `weakened`: particles that lose hold.
Hit find_cracks(const Pass& pass, const LiveModel& model, const ContactProblem& problem, const Movables& movables,
                const Pieces& pieces, std::span<const ParticleId> weakened);

}  // namespace sunder
