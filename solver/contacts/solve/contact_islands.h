// Contacts that hang together through what they push.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "solver/contacts/solve/contact_response.h"
#include "solver/data/ids.h"
#include "solver/threads/parallel.h"

namespace sunder {

/// Contacts of one island move nothing that those of another touch, so that each is solved by itself and ends when it
/// is done. Colliders join nothing. What islands touch is listed island after island, so that it can be packed.
struct ContactIslands {
    std::vector<ContactId> contact;        // in each island in stored order                        (n_contacts)
    std::vector<uint32_t> offset;          // of islands in `contact`                               (n_islands + 1)
    std::vector<PieceId> piece;            // that an island's contacts push
    std::vector<uint32_t> piece_offset;    // (n_islands + 1)
    std::vector<MovableId> movable;        // likewise
    std::vector<uint32_t> movable_offset;  // (n_islands + 1)
    // Where in `piece` and `movable` one is, or kNone (n_pieces, n_movables).
    std::vector<uint32_t> piece_slot, movable_slot;
    // Islands, share after share of what threads begin with, in each those with most contacts first: an island is in
    // the share that its things have of all.
    std::vector<IslandId> by_share;  // (n_islands)
    std::vector<uint32_t> share;     // offsets in by_share                                   (n_shares + 1)

    size_t size() const { return offset.size() - 1; }
    std::span<const ContactId> contacts_of(IslandId island) const {
        return std::span(contact).subspan(offset[island], offset[island + 1] - offset[island]);
    }
    std::span<const PieceId> pieces_of(IslandId island) const {
        return std::span(piece).subspan(piece_offset[island], piece_offset[island + 1] - piece_offset[island]);
    }
    std::span<const MovableId> movables_of(IslandId island) const {
        return std::span(movable).subspan(movable_offset[island], movable_offset[island + 1] - movable_offset[island]);
    }

    /// Calls body(island) for each. `workers`: as many threads as shares.
    template <class Body>
    void for_each(const WorkerPool& workers, const Body& body) const {
        constexpr size_t kGrain = 16;  // fewest contacts that a thread is worth waking for
        if (contact.size() < 2 * kGrain)
            std::ranges::for_each(by_share, body);
        else
            workers.for_shares(
                by_share.size(), [&](size_t s) { return share[s]; }, [&](size_t k, size_t) { body(by_share[k]); });
    }
};

/// Islands are numbered by their first contact. Tells the contacts which of them have hinges. `n_shares`: of threads.
void find_islands(const ContactBodies& bodies, std::span<ActiveContact> io_contacts, size_t n_shares,
                  ContactIslands& o_islands);

}  // namespace sunder
