// What rests is not simulated until something wakes it. Pieces and rigid bodies fall asleep one by one, where all that
// they lie on sleeps, and wake with what lies on them; hit hard, with all sleepers that they press on.
#pragma once

#include <span>

#include "solver/scene/scene.h"
#include "solver/step/find.h"

namespace sunder {

/// s; a piece or rigid body sleeps when all of it has hardly moved for so long.
constexpr double kTimeToSleep = 0.5;

/// s; how often it is looked what may fall asleep: what is simulated is numbered anew each time that something does.
constexpr double kSleepInterval = 0.25;

/// Of the normal forces on a sleeping piece when it fell asleep, or of its weight where that is more: so much less
/// wakes it at once; so much of a change, summed over its particles, at a look. What lies on four points and loses one
/// feels a quarter.
constexpr double kWakingLoss = 0.5, kWakingChange = 0.2;

bool anything_sleeps(const FrameState& state);

/// Everything is awake, and has moved just now.
void forget_sleep(size_t n_movables, FrameState& io_state);

/// To be called at the start of a frame: wakes what a changed gravity, force, material, pin or collider acts on, what
/// is near a collider that moves, what lost some of what carried it, and everything where sleepers were changed from
/// outside. `margin`: of contacts, m.
void wake_changed(const Scene& scene, const FrameInput& input, bool self_collision, double margin,
                  FrameState& io_state);

/// Wakes the pieces of these, and what lies on them. They go on from where they lie, with the contact forces that they
/// had.
void wake(const Scene& scene, const FrameInput& input, std::span<const Woken> woken, FrameState& io_state);

/// To be called at the end of a frame that began in `before`: counts how long things have been still, and puts pieces
/// to sleep if a multiple of kSleepInterval lies in the frame. Returns how many pieces there are.
size_t fall_asleep(const Scene& scene, const FrameInput& input, bool self_collision, const FrameState& before,
                   FrameState& io_state);

}  // namespace sunder
