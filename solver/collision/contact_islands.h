// Contacts that hang together through what they push.
#pragma once

#include <span>
#include <vector>

#include "solver/collision/contact_response.h"
#include "solver/parallel.h"

namespace sunder {

/// Contacts of one island move nothing that those of another touch, so that each is solved by itself and ends when it
/// is done. Colliders join nothing.
struct ContactIslands {
    std::vector<uint32_t> contact;  // island after island, in each in stored order  (n_contacts)
    std::vector<uint32_t> offset;   // (n_islands + 1)

    size_t size() const { return offset.size() - 1; }
    std::span<const uint32_t> of(size_t island) const {
        return {contact.data() + offset[island], offset[island + 1] - offset[island]};
    }
};

/// Islands are numbered by their first contact. Tells the contacts which of them have hinges.
void find_islands(const ContactBodies& bodies, std::span<ActiveContact> io_contacts, ContactIslands& o_islands);

/// Solves every island to where no pass changes a gap by more than `enough` (m), within so many Gauss-Seidel passes as
/// pay: 60, accelerated like nonlinear conjugate gradients (Silcowitz-Hansen, Niebuhr, Erleben 2010), where all are
/// rigid or whole, so that tall stacks and heavy on light stand; 12 plain ones where something hangs on hinges: there
/// the share of a push that moves a fragment alone makes the response unsymmetric, and more passes lead astray.
/// Threads share out islands.
void relax_contacts(const ContactBodies& bodies, const ContactIslands& islands, double enough,
                    const WorkerPool& workers, std::span<ActiveContact> io_contacts);

}  // namespace sunder
