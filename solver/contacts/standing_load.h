// Islands of contacts whose loads stand.
#pragma once

#include <span>

#include "solver/contacts/contact_islands.h"
#include "solver/contacts/contact_response.h"

namespace sunder {

/// Whether the first round of a substep is to leave an island with what its contacts start from, and then sets that: a
/// part of their last forces. So it is where nothing closes faster than `resting` (m/s), some piece gives and none
/// hangs on hinges: what carries a load pushes back by how it is bent, which no round knows of before shape matching. A
/// round sees it fall as fast as what it carries, and takes the load from it: weights on blocks sank by up to 0.4 too
/// far, as the substep had it, and trembled. The round after shape matching
/// sees both: call only where one comes before the last.
///
/// Not so where a held piece can be matched together with the inertia of all that it carries (contact_round.h,
/// kBrace): it needs to know where that is, and not what it weighed.
///
/// Needs the pieces' `own_share` of the first round.
bool keep_standing_load(const ContactBodies& bodies, const ContactIslands& islands, uint32_t island, double resting,
                        std::span<ActiveContact> io_contacts);

}  // namespace sunder
