// The first stages of a step: where things are, what holds them, and where inertia takes them.
#pragma once

#include <span>

#include "solver/matching/live_model.h"
#include "solver/pieces/pieces.h"
#include "solver/step/second_order.h"

namespace sunder {

/// Positions, rotations since rest, inverse masses, inertia and velocities as forces take them, of what takes the pass.
void load(const StepContext& context, const StepTime& time, const FrameState& state, const GroupShapes& shapes,
          std::span<const uint8_t> kept, Movables& io_movables);

/// Pins hold, and nothing moves what sleeps. Bends the thin groups that pins hold.
void hold(const StepContext& context, const StepTime& time, const FrameState& state, const StepPair& pair,
          LiveModel& io_model, Movables& io_movables);

/// Pieces of which something is held, or tied.
void mark_held_pieces(const StepContext& context, const LiveTopology& live, const Movables& movables,
                      Pieces& io_pieces);

/// Where inertia takes what is not held, and what is smooth in a pair. What is bound and in a pair goes elsewhere
/// (`pair_up`).
void predict(const StepContext& context, const StepTime& time, const LiveModel& model, std::span<const uint8_t> kept,
             std::span<const ActiveContact> contacts, StepPair& io_pair, Movables& io_movables);

}  // namespace sunder
