// Loops of a step, in parts on all threads.
#pragma once

#include <algorithm>
#include <span>

#include "solver/contacts/solve/contact_response.h"
#include "solver/matching/unit_schedule.h"
#include "solver/scene/step_context.h"

namespace sunder {

/// Calls body(i) for i in [0, n).
template <class Body>
void for_all(const StepContext& context, size_t n, const Body& body) {
    context.workers.for_range(n, kParticleGrain, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) body(i);
    });
}

/// Calls body(first, last) for groups [0, n_particles()). What a group costs differs by far where some flow: who is
/// done takes over parts that others have not begun.
template <class Body>
void for_groups(const StepContext& context, const Body& body) {
    constexpr size_t kPart = 64;
    const size_t n = context.n_particles();
    if (context.workers.threads() == 1 || n < 2 * kGroupGrain) {
        if (n > 0) body(size_t{0}, n);
        return;
    }
    context.workers.for_each((n + kPart - 1) / kPart,
                             [&](size_t part) { body(part * kPart, std::min(n, (part + 1) * kPart)); });
}

/// Calls body(some of the contacts).
template <class Contacts, class Body>
void for_contacts(const StepContext& context, Contacts& contacts, const Body& body) {
    constexpr size_t kGrain = 256;  // fewest a thread is worth waking for
    context.workers.for_range(contacts.size(), kGrain, [&](size_t first, size_t last) {
        body(std::span(contacts).subspan(first, last - first));
    });
}

}  // namespace sunder
