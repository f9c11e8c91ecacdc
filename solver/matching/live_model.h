// What hangs together, and how it resists: of a scene in a state.
#pragma once

#include <vector>

#include "solver/matching/bending_shape.h"
#include "solver/matching/group_shape.h"
#include "solver/scene/live_topology.h"

namespace sunder {

struct LiveModel {
    LiveTopology live;
    GroupShapes shapes;
    std::vector<GroupStiffness> stiffness;  // (n_particles)
    std::vector<uint8_t> thin;              // kThin, kSlender or 0 (n_particles), or empty: nothing bends
    std::vector<uint8_t> pinned;            // wholly held by a pin; where something is thin (n_particles)
    BendingShapes bending;                  // of `thin`
    std::vector<uint8_t> edges;             // intact ones, that it was made of
    std::vector<double> hold;               // FrameState::edge_hold, likewise

    /// It bends by its curvature where anything does.
    bool is_thin(ParticleIndex group) const { return !thin.empty() && bending.is_thin(group); }
    /// So, and something bends in it.
    bool bends(ParticleIndex group) const { return is_thin(group) && bending.pulls(group); }
    const BendingShapes* bending_shapes() const { return thin.empty() ? nullptr : &bending; }

    /// Brings it in line with a state that was set from outside. False where it was.
    bool synchronise(const SimulationMesh& rest, const FrameState& state, const WorkerPool& workers);
    /// The same for a scene that was numbered anew; `former` (n_particles): the number in the scene before, or none,
    /// ascending. What a particle that kept its ring had is taken over. Which these are is returned.
    std::vector<ParticleId> renumber(const SimulationMesh& rest, const FrameState& state,
                                     std::span<const ParticleId> former, const WorkerPool& workers);
    /// What may be another in any frame: materials are animated, too. `may_bend`: the method knows of bending.
    void take_up_materials(const SimulationMesh& rest, std::span<const Material> materials, const FrameState& state,
                           bool may_bend, const WorkerPool& workers);
    /// The same of one group whose rest shape or stiffness changed. `factor`: FrameState::stiffness_factor.
    void take_up_stiffness(const SimulationMesh& rest, const Material& material, double factor, ParticleIndex group);
    /// The rest shapes of thin groups as they stand.
    void take_up_bending(const SimulationMesh& rest, const FrameState& state, const WorkerPool& workers);
};

/// Whether waves run through these particles, one piece, in no less than some steps of h seconds: else what an implicit
/// step makes of them must not be carried on.
bool resolves_waves(const LiveModel& model, std::span<const ParticleId> particles, double h);

/// The sum of b = h^2 k over the groups of a particle: what they hold it with in a step, over its mass.
double sum_of_pulls(const LiveModel& model, double h, ParticleIndex particle);

}  // namespace sunder
