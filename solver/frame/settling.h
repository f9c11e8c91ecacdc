// Equilibrium before the first frame: what settles bears its weight when the shot begins, instead of being dropped on
// it.
#pragma once

#include <vector>

#include "solver/data/progress.h"
#include "solver/scene/scene.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// What came of it.
struct Settled {
    bool at_rest = true;               // else something moved still when it ended
    MovableId moves;                   // that moved most then
    std::vector<BrokenEdge> breaking;  // edges that the load of the equilibrium would break
    std::vector<EdgeId> weakening;     // others that it would weaken (a fracture energy)
};

bool anything_settles(const Scene& scene);

/// Brings what settles to rest under the loads of `input`, as it is at the end of its frame. Nothing breaks; material
/// flows. What does not settle stands where it is, to lie on and to be leaned against; all velocities are those of the
/// start. `io_state`: the initial one. By method projective, whatever the settings say. Errors: cancelled, numbers gone
/// bad.
Result<Settled> settle(const Scene& scene, const FrameInput& input, const SolverSettings& settings,
                       const WorkerPool& threads, const Progress& progress, FrameState& io_state);

}  // namespace sunder
