// What touches what in a step.
#pragma once

#include <span>
#include <vector>

#include "solver/contacts/find/scene_contacts.h"
#include "solver/pieces/contact_problem.h"
#include "solver/pieces/pieces.h"
#include "solver/step/slice.h"

namespace sunder {

/// A sleeper, or what stands by, that feels what touches it.
struct Woken {
    MovableId movable;
    bool passes_on;  // all sleepers that hang together with it through pieces and contacts wake, too
};

/// Fills `contacts`, from where things are and where they would go alone; or, where `may_wake` and something fixed
/// feels what touches it, tells which.
std::vector<Woken> find_contacts(const StepContext& context, const StepTime& time, const LiveTopology& live,
                                 const FrameState& state, const Movables& movables, bool may_wake,
                                 SceneContacts& io_detection, std::vector<ActiveContact>& o_contacts);

/// Pieces as contacts see them, from the start of the step, and what hangs together through contacts; anew when edges
/// broke. `smooth`: as StepPair's.
void take_up_contacts(const StepContext& context, double h, const LiveTopology& live, std::span<const uint8_t> smooth,
                      const Slice& slice, const Movables& movables, ContactProblem& io_problem, Pieces& io_pieces);

/// Gives contacts what lasts of their forces in the step before, or of the pass before.
void start_contacts(const StepContext& context, double h, const FrameState& state, const Slice& slice,
                    const ContactBodies& bodies, std::vector<ActiveContact>& io_contacts);

}  // namespace sunder
