// One step of the whole scene (docs/theory.md, "The step").
#pragma once

#include <span>
#include <vector>

#include "solver/contacts/find/scene_contacts.h"
#include "solver/step/breaking.h"
#include "solver/step/find.h"
#include "solver/step/flow.h"
#include "solver/step/hits.h"
#include "solver/step/matching.h"
#include "solver/step/second_order.h"
#include "solver/step/slice.h"

namespace sunder {

/// What a step keeps for the next. All of it is derived from rest data and the state alone, so it may be made anew at
/// any time without changing a bit of the result, but for `pair`, which goes on from the first to the second step of a
/// pair.
struct StepMemory {
    StepPair pair;
    LiveModel model;
    SceneContacts detection;
    Matching matching;
    // Scratch.
    Movables movables;
    Pieces pieces;
    ContactProblem problem;
    Breaking breaking;
    BeforeFlow before_flow;
    Slice slice;

    /// Brings it in line with a state that was set from outside.
    void synchronise(const StepContext& context, const FrameState& state);
    /// The same for a scene that was numbered anew; `former` (n_particles): the number in the scene before, or none,
    /// ascending. What a particle that kept its ring had is taken over.
    void renumber(const StepContext& context, const FrameState& state, std::span<const ParticleId> former);

private:
    void fit(const StepContext& context);
    void take_up_frame(const StepContext& context, const FrameState& state);
};

/// s; no step is longer: frames of less than 24 a second are divided, whatever the settings say. Newton steps and
/// contacts take turns, and what a contact leaves to a stiff body over a longer step can be more energy than all of the
/// scene had.
constexpr double kLongestStep = 0.042;

/// Why a step was not taken, and the state is as before, but for what contacts let go.
struct StepOutcome {
    std::vector<Woken> woken;  // where it is not empty: wake these, and take the step again
    Hit hit;                   // where its parts are above 1: take the step in so many

    bool is_taken() const { return woken.empty() && hit.parts == 1; }
};

/// Advances by a step. On an error the state is spoilt: keep a copy.
Result<StepOutcome> step(const StepContext& context, const StepTime& time, StepMemory& io_memory, FrameState& io_state,
                         StepReport& io_report);

}  // namespace sunder
