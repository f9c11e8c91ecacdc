// The paper's corrector: sequential projection with a stiffness k in [0, 1]. Kept for comparison: its result depends on
// the order of the groups, the step and the number of sweeps (docs/theory.md, "The implicit step"); never the default.
#pragma once

#include <span>

#include "solver/data/role.h"
#include "solver/matching/group_shape.h"
#include "solver/matching/shape_matching.h"

namespace sunder {

/// One sweep over all groups in order. `stiffness`: k in [0, 1] (n_bodies). Held particles stay.
void gauss_seidel_sweep(const SimulationMesh& rest, const LiveTopology& live, const GroupShapes& shapes,
                        std::span<const double> stiffness, std::span<const Role> role,
                        std::span<MovingParticle> io_particles, std::span<GroupGoal> io_goals);

}  // namespace sunder
