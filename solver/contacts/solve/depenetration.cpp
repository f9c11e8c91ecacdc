#include "solver/contacts/solve/depenetration.h"

#include <algorithm>
#include <cmath>

namespace sunder {
namespace {

// Of the smaller particle's arm: from this depth on a normal says little of the way out.
constexpr double kDeep = 0.5;

struct Meeting {
    uint32_t low, high;  // pieces; or a piece and a collider
    ActiveContact* contact;
    Vec3 normal;  // from high to low
};

bool same_pair(const Meeting& x, const Meeting& y) { return x.low == y.low && x.high == y.high; }

bool is_whole(const ContactBodies& bodies, uint32_t piece) {
    return piece & Contact::kStatic || is_unbroken(bodies.pieces[piece].kind);
}
bool is_lone(const ContactBodies& bodies, uint32_t piece) {
    return !(piece & Contact::kStatic) && is_lone(bodies.pieces[piece].kind);
}
bool gives(const ContactBodies& bodies, uint32_t piece) {
    return !(piece & Contact::kStatic) && !bodies.pieces[piece].rigid;
}

bool is_deep(const ActiveContact& c) {
    double size = c.arm_a.norm();
    if (!(c.contact.b & Contact::kStatic)) size = std::min(size, c.arm_b.norm());
    return c.allowed_gap - c.contact.gap > kDeep * size;
}

// Of two at least one of which gives, and which are whole, or if anything is deep both give or are.
std::vector<Meeting> sorted_by_pair(const ContactBodies& bodies, std::span<ActiveContact> contacts) {
    const bool any_deep =
        std::ranges::any_of(contacts, [](const ActiveContact& c) { return c.recovery > 0 && is_deep(c); });
    const auto agrees = [&](uint32_t piece) { return is_whole(bodies, piece) || (any_deep && gives(bodies, piece)); };
    std::vector<Meeting> meetings;
    for (ActiveContact& c : contacts) {
        if (!c.separate_pieces) continue;
        const Contact& contact = c.contact;
        const uint32_t a = bodies.piece[contact.a];
        const uint32_t b = contact.b & Contact::kStatic ? contact.b.value : bodies.piece[contact.b].value;
        if (!agrees(a) || !agrees(b) || !(gives(bodies, a) || gives(bodies, b))) continue;
        if (a < b)
            meetings.push_back({a, b, &c, contact.normal});
        else
            meetings.push_back({b, a, &c, -contact.normal});
    }
    std::ranges::stable_sort(meetings, {}, [](const Meeting& o) { return std::pair(o.low, o.high); });
    return meetings;
}

// What the contacts of a pair ask for.
struct Asked {
    std::span<Meeting> contacts;
    Vec3 sum = Vec3::Zero();        // of what low is to move by, m
    double total = 0, fastest = 0;  // m
    bool whole = false;             // both are
    bool locked = false;            // some are deep, and not of a lone fragment: that may have been shot there

    Vec3 way() const { return sum / std::max(sum.norm(), 1e-300); }
};

Asked asked(const ContactBodies& bodies, std::span<Meeting> pair) {
    Asked all{pair};
    const uint32_t low = pair.front().low, high = pair.front().high;
    all.whole = is_whole(bodies, low) && is_whole(bodies, high);
    all.locked = !is_lone(bodies, low) && !is_lone(bodies, high) &&
                 std::ranges::any_of(pair, [](const Meeting& m) { return is_deep(*m.contact); });
    for (const Meeting& m : pair) {
        all.sum += m.contact->recovery * m.normal;
        all.total += m.contact->recovery;
        all.fastest = std::max(all.fastest, m.contact->recovery);
    }
    return all;
}

// All old ones push along `way`, of unit length, by `recovery`; new ones that stand in it let pass.
void go(const Asked& pair, const Vec3& way, double recovery) {
    for (const Meeting& m : pair.contacts) {
        ActiveContact& c = *m.contact;
        if (c.recovery > 0) {
            c.contact.normal = m.normal == c.contact.normal ? way : Vec3(-way);
            c.recovery = recovery;
        } else if (m.normal.dot(way) < 0) {
            c.wanted_gap = -kLetPass;
        }
    }
}

void slow_down(const Asked& pair, double share) {
    for (const Meeting& m : pair.contacts) m.contact->recovery *= share;
}

void agree(const Asked& pair) {
    const double length = pair.sum.norm();
    if (!(pair.total > 0 && length < pair.total)) return;  // no old overlap, or all of one mind
    if (pair.locked && length > 0) return go(pair, pair.way(), pair.fastest);
    if (!pair.whole) return;
    for (const Meeting& m : pair.contacts) {
        const double along = std::max(m.normal.dot(pair.way()), 0.0);
        m.contact->recovery = std::min(m.contact->recovery, length / pair.total * pair.fastest * along);
    }
}

// Of a piece that is deep in a collider: none of them pushes it into another, and where that leaves no way it stays.
void agree_with_colliders(std::span<const Asked> colliders) {
    constexpr double kNoWay = 0.2;  // of a unit vector, what is left of it
    for (const Asked& one : colliders) {
        Vec3 way = one.way();
        for (const Asked& other : colliders) way -= std::min(way.dot(other.way()), 0.0) * other.way();
        const double share = way.norm();
        if (share < kNoWay) {
            slow_down(one, 0);
        } else if (one.locked) {
            go(one, way / share, share * one.fastest);
        } else {
            agree(one);
            slow_down(one, share);
        }
    }
}

// By how far a collider moves towards what touches it, m.
double driven(const ActiveContact& c) { return c.contact.normal.dot(c.collider_motion); }

// What two colliders press on gets out between them, by the farther the more their normals are opposed, and has the
// speed of that: they shoot it like a cherry stone. Where its way out would be longer than kWayOut times what they ask
// for, they ask for less; what they close by beyond the room that it has then goes into it.
void give_way_between(std::span<ActiveContact> colliders) {
    constexpr double kWayOut = 4;
    const auto room = [](const ActiveContact& c) { return std::max(c.contact.gap - c.allowed_gap, 0.0); };
    for (ActiveContact& c : colliders) {
        double share = 1, lets_in = 0;
        for (const ActiveContact& other : colliders) {
            const double middle = 0.5 + 0.5 * c.contact.normal.dot(other.contact.normal);  // squared, of both normals
            const double asks = std::min(1.0, kWayOut * std::sqrt(std::max(middle, 0.0)));
            if (asks == 1) continue;
            if (room(other) == 0) share = std::min(share, asks);
            const double closing = driven(c) + driven(other), excess = closing - room(c) - room(other);
            const double mine = std::max(driven(c), 0.0), theirs = std::max(driven(other), 0.0);
            if (excess > 0) lets_in = std::max(lets_in, (1 - asks) * excess * mine / (mine + theirs));
        }
        c.recovery *= share;
        c.wanted_gap -= lets_in;
    }
}

}  // namespace

void agree_on_recovery(const ContactBodies& b, std::span<ActiveContact> io_contacts) {
    for (ActiveContact& c : io_contacts) c.wanted_gap = 0;
    std::vector<Meeting> meetings = sorted_by_pair(b, io_contacts);
    std::vector<Asked> colliders;  // of a piece
    for (size_t first = 0, last; first < meetings.size(); first = last) {
        for (last = first + 1; last < meetings.size() && same_pair(meetings[last], meetings[first]);) ++last;
        const Asked pair = asked(b, std::span(meetings).subspan(first, last - first));
        if (meetings[first].high & Contact::kStatic)
            colliders.push_back(pair);
        else
            agree(pair);
        if (last < meetings.size() && meetings[last].low == meetings[first].low) continue;
        if (std::ranges::any_of(colliders, &Asked::locked))
            agree_with_colliders(colliders);
        else
            std::ranges::for_each(colliders, agree);
        colliders.clear();
    }
    for (auto first = io_contacts.begin(), last = first; first != io_contacts.end(); first = last) {
        const auto with_it = [&](const ActiveContact& c) {
            return c.contact.a == first->contact.a && has_movable_b(c.contact) == has_movable_b(first->contact);
        };
        last = std::find_if_not(first, io_contacts.end(), with_it);
        if (!has_movable_b(first->contact) && last - first > 1) give_way_between({first, last});
    }
    for (ActiveContact& c : io_contacts)
        if (c.wanted_gap > -kLetPass) c.wanted_gap += std::min(c.allowed_gap, c.contact.gap + c.recovery);
}

}  // namespace sunder
