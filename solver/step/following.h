// Fragments that follow a source for as long as an activation keeps them.
#pragma once

#include "solver/pieces/movables.h"
#include "solver/scene/step_context.h"
#include "solver/step/pins.h"

namespace sunder {

/// Whether a fragment of a source follows it: something keeps it, and it was not let go.
bool follows(const FrameState& state, ParticleIndex particle);

/// Takes what follows, and no pin holds, to where its source has it at the end of the step (Movables::follows).
void take_up_followers(const StepContext& context, const StepTime& time, const FrameState& state,
                       Movables& io_movables);

/// Takes the same to where it is at other moments of a pair.
void hold_followers(const StepContext& context, const StepTime& time, Pinned when, const StepPair& pair,
                    Movables& io_movables);

/// Notes of what nothing keeps any more that it was let go, now. It goes on with the speed and spin that it has. At a
/// frame's begin these were those of the way there; half of the way that the source goes on by is added to half of
/// them, which is of second order. Whether there was any.
enum class LetGo { at_frame, in_step };
bool hand_over(const Scene& scene, const FrameInput& input, LetGo when, FrameState& io_state);

/// Of what follows at the end of a frame, what of its stretch is no strain.
void set_followers(const Scene& scene, const FrameInput& input, FrameState& io_state);
/// The curvature that particles' neighbours show is so for good, as their plastic deformation is (where anything
/// bends).
void bend_for_good(const SimulationMesh& rest, std::span<const ParticleId> particles, FrameState& io_state);

}  // namespace sunder
