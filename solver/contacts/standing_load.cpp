#include "solver/contacts/standing_load.h"

#include <algorithm>
#include <vector>

#include "solver/contacts/contact_round.h"

namespace sunder {
namespace {

// Of the last forces. They follow the deformation by a substep: with nine tenths a weight of ten times a block's own
// swings on it for ever, with none weights sink by up to a quarter more than they should.
constexpr double kKept = 0.75;

// Calls body(contact, movable, other) for each side of the island's contacts that a held piece has; other: what it
// meets there, or kStatic: a collider.
template <class Body>
void for_held_sides(const ContactBodies& b, const ContactIslands& islands, uint32_t island,
                    std::span<const ActiveContact> contacts, const Body& body) {
    const auto look = [&](const ActiveContact& c, uint32_t i, uint32_t other) {
        if (b.pieces[b.piece[i]].is_held() && b.inverse_mass[i] > 0) body(c, i, other);
    };
    for (const uint32_t k : islands.contacts_of(island)) {
        const ActiveContact& c = contacts[k];
        if (has_movable_b(c.contact)) {
            look(c, c.contact.a, c.contact.b);
            look(c, c.contact.b, c.contact.a);
        } else {
            look(c, c.contact.a, Contact::kStatic);
        }
    }
}

// Of what presses on held pieces, whether most is heavier than braces are.
bool outweighs_braces(const ContactBodies& b, const ContactIslands& islands, uint32_t island,
                      std::span<const ActiveContact> contacts) {
    const uint32_t first = islands.movable_offset[island];
    std::vector<double> on(islands.movables_of(island).size(), 0.0);  // forces on each that held pieces give, kg m
    const auto sum = [&](uint32_t i) -> double& { return on[islands.movable_slot[i] - first]; };
    for_held_sides(b, islands, island, contacts, [&](const ActiveContact& c, uint32_t, uint32_t other) {
        if (other != Contact::kStatic) sum(other) += c.before.normal;
    });
    double heavier = 0, all = 0;
    for_held_sides(b, islands, island, contacts, [&](const ActiveContact& c, uint32_t i, uint32_t other) {
        if (!(c.before.normal > 0)) return;
        all += c.before.normal;
        if (other == Contact::kStatic || !(b.inverse_mass[other] > 0)) return;
        const double brace = kBrace * (1 / b.pieces[b.piece[i]].own_share - 1) / b.inverse_mass[i];
        if (brace < c.before.normal / sum(other) / b.inverse_mass[other]) heavier += c.before.normal;
    });
    return heavier > 0.5 * all;
}

}  // namespace

bool keep_standing_load(const ContactBodies& b, const ContactIslands& islands, uint32_t island, double resting,
                        std::span<ActiveContact> io_contacts) {
    bool any = false;
    for (const uint32_t k : islands.contacts_of(island)) {
        const ActiveContact& c = io_contacts[k];
        if (c.has_hinges || c.approach_speed > resting) return false;
        any |= c.before.normal > 0;
    }
    if (!any) return false;
    const auto pieces = islands.pieces_of(island);
    if (std::ranges::all_of(pieces, [&](uint32_t p) { return b.pieces[p].rigid; })) return false;
    const auto is_held = [&](uint32_t p) { return b.pieces[p].is_held(); };
    if (std::ranges::any_of(pieces, is_held) && !outweighs_braces(b, islands, island, io_contacts)) return false;
    for (const uint32_t k : islands.contacts_of(island)) io_contacts[k].impulse = kKept * io_contacts[k].before;
    return true;
}

}  // namespace sunder
