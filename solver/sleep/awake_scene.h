// The part of a scene that does not sleep, as a scene of its own: so that sleepers cost nothing, whatever is done.
#pragma once

#include <span>
#include <vector>

#include "solver/step/step.h"

namespace sunder {

/// Holds everything awake, and those sleepers (fixed, without their edges) that something awake may touch soon. Derived
/// from the whole scene and a state; may be made anew at any time without changing a bit of the result: what nothing
/// touches changes nothing.
class AwakeScene {
public:
    /// Takes over a state in which something sleeps.
    void enter(const StepContext& whole, const FrameState& state);
    /// To be called where nothing sleeps any more: what falls asleep again need not lie where it did.
    void forget() { asleep_.clear(); }

    /// Advances what is awake by a step; the outcome is of movables of the whole scene. `io_state`: as enter; written
    /// to where more sleepers may be touched than are here.
    Result<StepOutcome> step(const StepContext& whole, const StepTime& time, FrameState& io_state,
                             StepReport& io_report);
    /// As letting_go.h's; `state`: as io_state of `step`.
    void let_go_between_steps(const StepContext& whole, const FrameState& state);
    /// Sees to it that all sleepers that may be touched in so many seconds, to `end` of the frame, are here.
    /// `io_state`: as of `step`.
    void cover(const StepContext& whole, double h, double end, FrameState& io_state);

    /// Writes what is awake back into the state of the whole scene.
    void leave(const WorkerPool& workers, FrameState& io_state);

    /// What the second substep of a pair needs of the first, of the whole scene; what was not here is not in it.
    StepPair pair(const WorkerPool& workers) const;
    /// To be called after `enter` between two substeps of a pair.
    void go_on(const StepPair& whole, const WorkerPool& workers);

    bool empty() const { return n_awake_ == 0; }
    StepContext context(const StepContext& whole) const;
    FrameState& state() { return state_; }
    StepMemory& memory() { return memory_; }

private:
    void build(const StepContext& whole, const FrameState& state);
    std::span<const ParticleId> particles() const { return particle_; }
    ParticleId particle_here(ParticleId whole) const { return ParticleId(index_[whole].value); }
    bool wake_here(const StepContext& whole, const FrameState& state);
    bool is_here(const ContactMemory& contact) const;  // whose movables are of the whole scene
    bool meets_more(const StepContext& whole, const FrameState& state, std::span<const Aabb> boxes,
                    std::span<const uint8_t> counts) const;
    void take_pins(const std::vector<Pin>& pins);
    void take_sources(const std::vector<Source>& sources);
    void take_seams(const std::vector<Seam>& seams);
    void take_activations(const std::vector<Activation>& activations);
    void take_particles(const SimulationMesh& rest, const WorkerPool& workers);
    void take_rings(const SimulationMesh& rest, const FrameState& state, const WorkerPool& workers);
    void take_edges(const SimulationMesh& rest, const WorkerPool& workers);
    void gather(const FrameState& state, const WorkerPool& workers);

    Scene scene_;
    FrameState state_;
    StepMemory memory_;
    std::vector<uint8_t> asleep_;  // what it was made for  (n_movables of the whole scene)
    // Here: which of the whole scene's; ascending.
    std::vector<MovableId> movable_;
    std::vector<ParticleId> particle_;
    std::vector<uint32_t> rigid_body_;
    std::vector<EdgeId> edge_;
    // Of the whole scene's: which here, or none.
    std::vector<MovableId> index_;
    std::vector<EdgeId> edge_here_;
    std::vector<uint8_t> fixed_;  // (n_movables)
    std::vector<Aabb> covered_;   // where neighbours are known (n_movables), m
    size_t n_awake_ = 0;
};

}  // namespace sunder
