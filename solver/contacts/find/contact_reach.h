// Which of the contacts that were found may push in a substep at all.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solver/collision/contact.h"

namespace sunder {

/// A contact as far as is known before hulls are asked.
struct ContactReach {
    double speed = 0;    // at which a and b may come closer, m/s
    double allowed = 0;  // it pushes at no wider gap, m
};

/// The contacts that may come to push within `h` seconds, ascending: those that are no farther apart than
/// two and a half of `margin` (m) and the way of the fastest contact that either thing has, for what hits one of the
/// two may throw it at the other. Neighbours lie in one another's ellipsoids, so that a quarter of what is found in
/// rubble overlaps and is millimetres apart nonetheless. `reach`: as contacts.
std::vector<ContactId> in_reach(std::span<const Contact> contacts, std::span<const ContactReach> reach,
                                size_t n_movables, double h, double margin);

}  // namespace sunder
