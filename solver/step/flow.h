// Plastic flow, and how near groups are to breaking.
#pragma once

#include <span>
#include <vector>

#include "solver/matching/live_model.h"
#include "solver/material/fracture.h"
#include "solver/pieces/movables.h"
#include "solver/step/matching.h"
#include "solver/step/slice.h"

namespace sunder {

/// What groups gave way to, and may break by.
struct Breaking {
    std::vector<GroupStrain> strains;  // (n_particles)
    std::vector<uint8_t> flowed;       // rest shapes that are to be made anew (n_particles)
};

struct Found {
    bool changed = false, overloaded = false;  // a rest shape flowed; a group is to break
};

/// Optimal stretch of every group that takes the pass, where things came to lie; flow above the yield strain, over so
/// many seconds; and the load towards breaking.
Found flow_and_measure(const Pass& pass, double seconds, const LiveModel& model, const Movables& movables,
                       Breaking& io_breaking, std::vector<GroupGoal>& io_goals, FrameState& io_state);

/// Below it no principal strain breaks a group.
double breaking_strain(const StepContext& context, const LiveTopology& live, ParticleIndex group);

/// Cuts edges of groups that are overloaded, to a share `leading` of the worst of their piece, and makes rest shapes
/// anew where material flowed or edges broke. The cuts.
std::span<const BrokenEdge> break_edges(const StepContext& context, double time, double leading,
                                        std::span<const MovingParticle> moving, LiveModel& io_model,
                                        Breaking& io_breaking, FrameState& io_state);

}  // namespace sunder
