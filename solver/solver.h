// The solver as its callers see it: a scene prepared once, states advanced frame by frame.
#pragma once

#include <memory>

#include "solver/data/progress.h"
#include "solver/frame/settling.h"
#include "solver/scene/scene.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// Holds rest data, scratch memory and worker threads; nothing that changes the result: all that is simulated lies in
/// the FrameState, so any state may be given at any time. Not to be called from two threads at once.
class Solver {
public:
    /// `threads` 0: all cores; all of them in each frame. Errors: empty scene, indices out of range, non-finite rest
    /// data (particle named).
    static Result<std::unique_ptr<Solver>> create(Scene scene, int threads = 1);
    /// The same with workers that others use as well, though never at the same time: those of two pools would look for
    /// work beside one another. Small scenes that are faster without them do without (thread_trial.h).
    static Result<std::unique_ptr<Solver>> create(Scene scene, std::shared_ptr<const WorkerPool> workers);
    ~Solver();

    const Scene& scene() const;
    /// At rest as placed, with the bodies' velocities and each body's yield from `materials` (one a body).
    FrameState initial_state(const std::vector<Material>& materials) const;
    /// Brings what settles of an initial state to rest under the loads of `input` (solver/frame/settling.h). On an
    /// error `io_state` is as before.
    Result<Settled> settle(const FrameInput& input, const SolverSettings& settings, FrameState& io_state,
                           const Progress& progress = {}) const;

    /// One frame, from the state `before` it to another that comes after it. On an error (input of the wrong size,
    /// numbers gone bad: particle named; cancelled) `o_after` holds nothing of use.
    Result<StepReport> advance(const FrameInput& input, const SolverSettings& settings, const FrameState& before,
                               FrameState& o_after, const Progress& progress = {});
    /// The same in place; on an error `io_state` is as before.
    Result<StepReport> advance(const FrameInput& input, const SolverSettings& settings, FrameState& io_state,
                               const Progress& progress = {});

    /// A state of the wrong size or with non-finite numbers is refused, by name of the array and particle.
    Status check_state(const FrameState& state) const;

private:
    Solver();
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Pieces: connected components of a range of particles under intact edges. Returns a piece index a particle,
/// numbered by first particle; the count is the largest plus one.
std::vector<PieceId> connected_pieces(const SimulationMesh& rest, const std::vector<uint8_t>& edge_intact);

}  // namespace sunder
