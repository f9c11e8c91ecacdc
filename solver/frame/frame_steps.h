// A frame in steps: as many as settings, budget and hits ask for, of what is awake.
#pragma once

#include <optional>
#include <vector>

#include "solver/data/progress.h"
#include "solver/frame/local_hit.h"
#include "solver/sleep/awake_scene.h"

namespace sunder {

class FrameSteps {
public:
    /// The scene must outlive this.
    explicit FrameSteps(const Scene& scene) : scene_(scene), margin_(contact_margin(scene)) {}

    /// Spoils the state on an error; `before` is what it was.
    Result<StepReport> run(const FrameInput& input, const SolverSettings& settings, const FrameState& before,
                           const WorkerPool& threads, FrameState& io_state, const Progress& progress);
    /// To be called where scratch may be half written.
    void forget() { memory_ = {}, awake_ = {}, local_hit_.reset(); }

private:
    void enter(const StepContext& whole, const FrameState& state);
    StepPair pair(const WorkerPool& threads, const FrameState& state);
    void go_on(const StepContext& whole, const FrameState& state, StepPair pair);
    void let_go(const StepContext& whole, FrameState& io_state);
    bool plan(const StepContext& whole, SolverSettings& io_effort, FrameState& io_state, StepReport& io_report);
    Result<Hit> advance(const StepContext& whole, const StepTime& time, FrameState& io_state, StepReport& io_report);
    Result<bool> advance_local_hit(const StepContext& whole, const Hit& hit, const StepTime& time,
                                   const Progress& progress, FrameState& io_state, StepReport& io_report);
    Result<bool> advance_hit(const StepContext& whole, const Hit& hit, const StepTime& time, const Progress& progress,
                             FrameState& io_state, StepReport& io_report);

    const Scene& scene_;
    double margin_;                      // of contacts, m
    StepMemory memory_;                  // of the whole scene
    AwakeScene awake_;                   // what is simulated while something sleeps
    std::optional<LocalHit> local_hit_;  // from the first of a frame until a frame had none
    bool has_local_hits_ = false;        // this frame
    bool met_ = false;                   // in it what was hit met the rest: it may again
};

}  // namespace sunder
