// What lasts of contacts' forces from substep to substep.
#pragma once

#include <span>
#include <vector>

#include "solver/contacts/solve/contact_islands.h"
#include "solver/contacts/solve/contact_response.h"
#include "solver/contacts/solve/contact_round.h"

namespace sunder {

/// Lasting contacts start from a share of the forces they had; where nothing hangs on hinges and they approach or part
/// no faster than `resting` (m/s) from most of it. All of it is where their last round starts from (ContactRound), for
/// the last rounds of two substeps solve the same problem. `memory` and contacts ascending by (a, b).
void warm_start(const ContactBodies& bodies, std::span<const ContactMemory> memory, double h, double resting,
                std::span<ActiveContact> io_contacts);

/// Takes back of an island's warm start what would throw it. Forces that all but cancel, such as those that lock things
/// in a press, throw what they held where they no longer do: with pieces as wholes they would give more energy than
/// there is in how the island moves and falls in the substep, and more than contacts want. As much of them is left as
/// comes nearest to what contacts want. `io_motion` is scratch: zero, and left so (as pieces).
void temper_warm_start(const ContactBodies& bodies, const ContactIslands& islands, IslandId island, double h,
                       double acceleration, std::span<PieceMotion> io_motion, std::span<ActiveContact> io_contacts);

/// What lasts of the forces: of more than a contact had before, half as much again and what gravity may have put on the
/// lighter of the two, with `acceleration` in m/s2. A load is all there after some substeps; a hit is not, and would be
/// given twice.
void remember(const ContactBodies& bodies, std::span<const ActiveContact> contacts, double h, double acceleration,
              std::vector<ContactMemory>& o_memory);

}  // namespace sunder
