#include "solver/contacts/solve/contact_islands.h"

#include <algorithm>
#include <numeric>

#include "solver/data/disjoint_sets.h"
#include "solver/data/ids.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

bool is_hinged(const ContactBodies& b, MovableId i) {
    const ContactPiece& p = b.pieces[b.piece[i]];
    return !p.rigid && !is_unbroken(p.kind);
}

// Items once each, in the order in which the islands' contacts name them.
template <class ItemId>
class Slots {
public:
    Slots(size_t n_items, std::vector<ItemId>& o_item, std::vector<uint32_t>& o_offset, std::vector<uint32_t>& o_slot)
        : item_(o_item), offset_(o_offset), slot_(o_slot) {
        item_.clear();
        offset_.assign(1, 0);
        slot_.assign(n_items, kNone);
    }
    void add(ItemId i) {
        if (slot_[i] != kNone) return;
        slot_[i] = static_cast<uint32_t>(item_.size());
        item_.push_back(i);
    }
    void end_island() { offset_.push_back(static_cast<uint32_t>(item_.size())); }

private:
    std::vector<ItemId>& item_;
    std::vector<uint32_t>&offset_, &slot_;
};

void list_what_they_touch(const ContactBodies& b, std::span<const ActiveContact> contacts, ContactIslands& io) {
    Slots pieces(b.pieces.size(), io.piece, io.piece_offset, io.piece_slot);
    Slots movables(b.piece.size(), io.movable, io.movable_offset, io.movable_slot);
    for (size_t n = 0; n < io.size(); ++n) {
        for (uint32_t k = io.offset[n]; k < io.offset[n + 1]; ++k) {
            const Contact& c = contacts[io.contact[k]].contact;
            movables.add(c.a), pieces.add(b.piece[c.a]);
            if (has_movable_b(c)) movables.add(c.b), pieces.add(b.piece[c.b]);
        }
        movables.end_island(), pieces.end_island();
    }
}

// By the contact in the middle of an island: contacts ascend by what they touch, and so do threads in what they work on
// elsewhere.
void share_out(const ContactBodies& b, std::span<const ActiveContact> contacts, size_t n_shares, ContactIslands& io) {
    std::vector<uint32_t> share_of(io.size());
    io.share.assign(n_shares + 1, 0);
    for (uint32_t n = 0; n < io.size(); ++n) {
        const ContactId middle = io.contact[(io.offset[n] + io.offset[n + 1]) / 2];
        share_of[n] = static_cast<uint32_t>(contacts[middle].contact.a * n_shares / b.piece.size());
        ++io.share[share_of[n] + 1];
    }
    std::partial_sum(io.share.begin(), io.share.end(), io.share.begin());
    io.by_share.resize(io.size());
    std::iota(io.by_share.begin(), io.by_share.end(), IslandId(0));
    const auto size = [&](IslandId n) { return io.offset[n + 1] - io.offset[n]; };
    const auto comes_first = [&](IslandId m, IslandId n) {
        return share_of[m] < share_of[n] || (share_of[m] == share_of[n] && size(m) > size(n));
    };
    std::ranges::stable_sort(io.by_share, comes_first);
}

// Whether each contact, and each piece and movable that contacts push, is in one island, and together with what it
// touches.
bool are_whole(const ContactBodies& b, std::span<const ActiveContact> contacts, const ContactIslands& islands) {
    std::vector<IslandId> of_piece(b.pieces.size()), of_movable(b.piece.size());
    const auto is_of = [](IslandId& io_island, IslandId island) {
        if (io_island.is_none()) io_island = island;
        return io_island == island;
    };
    size_t n_contacts = 0;
    for (IslandId island(0); island < islands.size(); ++island)
        for (const ContactId k : islands.contacts_of(island)) {
            const Contact& c = contacts[k].contact;
            ++n_contacts;
            if (!is_of(of_piece[b.piece[c.a]], island) || !is_of(of_movable[c.a], island)) return false;
            if (has_movable_b(c) && (!is_of(of_piece[b.piece[c.b]], island) || !is_of(of_movable[c.b], island)))
                return false;
        }
    return n_contacts == contacts.size();
}

}  // namespace

void find_islands(const ContactBodies& b, std::span<ActiveContact> io_contacts, size_t n_shares,
                  ContactIslands& o_islands) {
    SUNDER_ASSERT(n_shares > 0 && b.inverse_mass.size() == b.piece.size());
    std::vector<uint32_t> sets = disjoint_sets(b.pieces.size());
    for (const ActiveContact& c : io_contacts)
        if (has_movable_b(c.contact)) unite(sets, b.piece[c.contact.a], b.piece[c.contact.b]);
    const auto root = [&](MovableId i) { return lowest(sets, b.piece[i]); };
    std::vector<IslandId> number(b.pieces.size()), island(io_contacts.size());
    std::vector<uint8_t> hinged(b.pieces.size(), 0);  // by root
    o_islands.offset.assign(1, 0);
    for (size_t k = 0; k < io_contacts.size(); ++k) {
        const Contact& c = io_contacts[k].contact;
        const uint32_t r = root(c.a);
        if (number[r].is_none()) {
            number[r] = IslandId(o_islands.size());
            o_islands.offset.push_back(0);
        }
        island[k] = number[r];
        ++o_islands.offset[island[k] + 1];
        hinged[r] |= is_hinged(b, c.a) || (has_movable_b(c) && is_hinged(b, c.b));
    }
    std::partial_sum(o_islands.offset.begin(), o_islands.offset.end(), o_islands.offset.begin());
    std::vector<uint32_t> next(o_islands.offset.begin(), o_islands.offset.end() - 1);
    o_islands.contact.resize(io_contacts.size());
    for (ContactId k(0); k < io_contacts.size(); ++k) {
        o_islands.contact[next[island[k]]++] = k;
        io_contacts[k].has_hinges = hinged[root(io_contacts[k].contact.a)];
    }
    list_what_they_touch(b, io_contacts, o_islands);
    share_out(b, io_contacts, n_shares, o_islands);
    invariant("islands are whole", [&] { return are_whole(b, io_contacts, o_islands); });
}

}  // namespace sunder
