#include "solver/contacts/find/contact_reach.h"

#include <algorithm>

#include "solver/data/invariant.h"

namespace sunder {

std::vector<ContactId> in_reach(std::span<const Contact> contacts, std::span<const ContactReach> reach,
                                size_t n_movables, double h, double margin) {
    SUNDER_ASSERT(reach.size() == contacts.size() && h > 0 && margin > 0);
    constexpr double kMarginsApart = 2.5;          // leaves out 4 in 10,000 of those that push, at most; 1: 8
    std::vector<double> fastest(n_movables, 0.0);  // of a movable's contacts, m/s
    const auto is_movable = [](MovableId b) { return !(b & Contact::kStatic); };
    for (size_t k = 0; k < contacts.size(); ++k) {
        const Contact& c = contacts[k];
        fastest[c.a] = std::max(fastest[c.a], reach[k].speed);
        if (is_movable(c.b)) fastest[c.b] = std::max(fastest[c.b], reach[k].speed);
    }
    std::vector<ContactId> those;
    for (ContactId k(0); k < contacts.size(); ++k) {
        const Contact& c = contacts[k];
        const double speed = std::max(fastest[c.a], is_movable(c.b) ? fastest[c.b] : 0.0);
        if (c.gap - reach[k].allowed <= kMarginsApart * margin + h * speed) those.push_back(k);
    }
    return those;
}

}  // namespace sunder
