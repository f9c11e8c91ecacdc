// Contacts that hang together through what they push.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/contact_response.h"

namespace sunder {

/// Contacts of one island move nothing that those of another touch, so that each is solved by itself and ends when it
/// is done. Colliders join nothing. What islands touch is listed island after island, so that it can be packed.
struct ContactIslands {
    std::vector<uint32_t> contact;         // in each island in stored order                        (n_contacts)
    std::vector<uint32_t> offset;          // of islands in `contact`                               (n_islands + 1)
    std::vector<uint32_t> piece;           // that an island's contacts push
    std::vector<uint32_t> piece_offset;    // (n_islands + 1)
    std::vector<uint32_t> movable;         // likewise
    std::vector<uint32_t> movable_offset;  // (n_islands + 1)
    std::vector<uint32_t> piece_slot, movable_slot;  // where in `piece` and `movable` one is  (n_pieces, n_movables)

    size_t size() const { return offset.size() - 1; }
};

/// Islands are numbered by their first contact. Tells the contacts which of them have hinges.
void find_islands(const ContactBodies& bodies, std::span<ActiveContact> io_contacts, ContactIslands& o_islands);

}  // namespace sunder
