// How overlap that was there before is worked off.
#pragma once

#include <span>

#include "solver/contacts/solve/contact_response.h"

namespace sunder {

constexpr double kLetPass = 1e30;  // m; a contact that wants no gap above minus this never pushes

/// Fills `wanted_gap`, and cuts `recovery` (as each contact alone would have it) to what things can follow as wholes:
/// bodies that nothing broke yet, rigid ones and colliders, where one of two gives. Where they lie in one another,
/// their contacts point every way, and to follow them all would squeeze what is locked between: energy from nowhere. So
/// the contacts of a pair ask for the motion along their mean direction, the slower the less they agree. Where some are
/// deep, of torn pieces, too, all old ones take that direction for their normal, and new ones that would stand in its
/// way let pass; a collider, of that direction, what leads into no other that the piece lies in, and if that is next to
/// nothing the piece stays. Lone fragments keep their normals: shot deep into a plate they would find their way out
/// behind it. Colliders give way to what they would shoot out between them. Contacts ascending by (a, b).
void agree_on_recovery(const ContactBodies& bodies, std::span<ActiveContact> io_contacts);

}  // namespace sunder
