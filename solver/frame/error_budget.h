// How many substeps a frame needs for an error that the artist allows: few while nothing happens, many in an impact.
#pragma once

#include <optional>

#include "solver/step/step.h"

namespace sunder {

/// What a frame is to cost.
struct FramePlan {
    int substeps = 1, iterations = 1;
    /// The frame itself where one substep is enough: the trial that told so is it.
    std::optional<FrameState> done;
    StepReport report;  // of `done`
};

constexpr int kMostBudgetSubsteps = 64;  // a frame
constexpr int kContactSubsteps = 8;      // at least where things touch: contacts carry no weight over a whole frame

/// Tries the frame in one substep and reads off what it does to the state; the trial costs about as much as a substep
/// of two iterations, and is the frame where nothing more is needed.
///
/// * Oscillation. With u the deformation that the trial makes, a piece at a time, its frequency is
///   omega^2 = <u, K u> / <u, M u> (Rayleigh's quotient). Steps of length h get its phase wrong by (omega h)^2 / 3 in
///   implicit Euler steps, by `phase_error` in pairs. It counts as far as elastic forces and contacts push particles
///   off their inertial paths: a body that is driven steadily, at rest, or tumbling as a whole asks for nothing.
/// * Breaking. A group that nears its toughness is late by up to a substep: the strain of one is to stay below the
///   budget's share of half the toughness.
///
/// A trial of a whole frame says little of what lies on something: pieces that a first short substep leaves calm are
/// left out, and take the substeps that contacts need.
///
/// Depends on the state and the input alone, so that a resumed simulation takes the same steps. `io_memory` is in line
/// with `state` before and after.
FramePlan plan_frame(const StepContext& context, const FrameState& state, StepMemory& io_memory);

}  // namespace sunder
