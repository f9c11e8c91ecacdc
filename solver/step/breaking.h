// What breaks: groups at once, or edges that fade; and what that leaves of the groups.
#pragma once

#include <span>
#include <vector>

#include "solver/contacts/solve/contact_response.h"
#include "solver/matching/live_model.h"
#include "solver/material/fading.h"
#include "solver/material/fracture.h"
#include "solver/pieces/movables.h"
#include "solver/step/slice.h"

namespace sunder {

/// What groups gave way to, and may break by.
struct Breaking {
    std::vector<GroupStrain> strains;   // (n_particles)
    std::vector<uint8_t> flowed;        // rest shapes that are to be made anew (n_particles)
    std::vector<GroupStretch> stretch;  // where edges fade (n_particles), or empty
};

/// Whether the edges of a particle fade instead of its group breaking.
bool fades(const StepContext& context, const FrameState& state, ParticleIndex particle);

/// Whether a particle's strain is followed from step to step, as what is stored in it asks hits for parts.
bool follows_strain(const StepContext& context, const FrameState& state, ParticleIndex particle);

/// Below it no principal strain breaks the group, or parts an edge of it.
double breaking_strain(const StepContext& context, const FrameState& state, const LiveTopology& live,
                       ParticleIndex group);

/// An edge that is to fade to this damage.
struct Fade {
    EdgeId edge;
    double damage = 0, tension = 0, toughness = 0;
};

/// What is to break.
struct Breaks {
    std::vector<BrokenEdge> cuts;  // of groups that are overloaded
    std::vector<Fade> fading;
    std::vector<ParticleId> weakened;  // an end of each edge that is to be cut or to fade much; ascending
};

struct Broken {
    size_t n_cuts = 0;      // the last of FrameState::broken
    double dissipated = 0;  // of the elastic energy, what edges that fade took, J
};

/// Edges of groups that are overloaded, to a share `leading` of the worst of their piece; and edges that fade.
Breaks find_breaks(const Pass& pass, double leading, const Movables& movables, std::span<const GroupGoal> goals,
                   const LiveModel& model, const Breaking& breaking);

/// Cuts edges, lets edges fade, and makes rest shapes anew where material flowed or edges broke or faded.
///
/// What fades takes weight out of its two groups, whose stiffness would then be that of what they held: as k_g is that
/// of the whole ring, what stands beside a crack would lose half of its stiffness along the crack, too, and the shot
/// half of its energy. Hence a group gets stiffness back, as much as its energy was lowered by, here and where the step
/// began, and no more than its ring lost; where its energy would rise (shapes of other rings are not monotone) it loses
/// some. So no change of an edge adds energy. An edge that fades does not profit of it.
/// `contacts`: of the step, with their impulses; what is cut is told what pushed it (pushers.h).
Broken break_edges(const Pass& pass, Breaks breaks, const Movables& movables, std::span<const GroupGoal> goals,
                   std::span<const ActiveContact> contacts, LiveModel& io_model, Breaking& io_breaking,
                   FrameState& io_state);

}  // namespace sunder
