// What activations keep from moving or breaking, in a step, and what contacts let go of it.
#pragma once

#include <span>
#include <vector>

#include "solver/contacts/solve/contact_response.h"
#include "solver/pieces/movables.h"
#include "solver/scene/live_topology.h"
#include "solver/scene/step_context.h"

namespace sunder {

/// Bits of Inactivity::what by which an activation keeps its fragments.
uint8_t bit_of(Keeps keeps);

inline void let_go(Inactivity& io_inactivity, Keeps keeps) {
    io_inactivity.what &= static_cast<uint8_t>(~bit_of(keeps));
    if (io_inactivity.what == Inactivity::kTouched) io_inactivity.what = 0;
}

/// Whether a contact lets it go.
inline bool waits_for_contact(const Activation& a) { return a.until == Until::contact || a.keeps == Keeps::asleep; }

inline bool is_kept(const FrameState& state, ParticleIndex particle) {
    return !state.inactive.empty() && (state.inactive[particle].what & (Inactivity::kHeld | Inactivity::kAsleep)) != 0;
}

/// What is held stands, but for what an active pin or a source moves.
void hold_inactive(const FrameState& state, Movables& io_movables);

/// Whether contacts of a step may let go of anything.
bool contacts_let_go(const StepContext& context, const FrameState& state);

/// Lets go of what contacts push by more than it takes, with what they pushed it by in this frame and the one before.
/// Whether there was any: the step is to be taken again.
bool let_go_of_pushed(const StepContext& context, double h, const LiveTopology& live,
                      std::span<const ActiveContact> contacts, const Movables& movables, FrameState& io_state);

/// Adds what contacts of a step that was taken pushed by.
void add_pushes(const StepContext& context, double h, std::span<const ActiveContact> contacts, const Movables& movables,
                FrameState& io_state);

/// Lets go of what waits for an edge to break beside it: one that broke in this frame. Whether any of it was glued.
bool let_go_beside_breaks(const Scene& scene, std::span<const BrokenEdge> broken, FrameState& io_state);

/// The same between two steps of a frame, whatever takes them, and what hangs on it: glue that let go bears as it did
/// before, and what followed a source goes on by itself. `broken`: in the frame so far.
void let_go_between_steps(const Scene& scene, const FrameInput& input, std::span<const BrokenEdge> broken,
                          FrameState& io_state);

/// FrameState::edge_bond, of what is glued, of seams, and of what is carried along by a source: that bears nothing.
void take_up_bonds(const Scene& scene, const FrameInput& input, FrameState& io_state);

}  // namespace sunder
