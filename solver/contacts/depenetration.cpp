#include "solver/contacts/depenetration.h"

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

// Between pieces of which each is `whole`.
template <class Whole>
std::vector<Meeting> sorted_by_pair(std::span<const uint32_t> piece, const Whole& whole,
                                    std::span<ActiveContact> contacts) {
    std::vector<Meeting> meetings;
    for (ActiveContact& c : contacts) {
        if (!c.separate_pieces) continue;
        const Contact& contact = c.contact;
        const uint32_t a = piece[contact.a], b = contact.b & Contact::kStatic ? contact.b : piece[contact.b];
        if (!whole(a) || !whole(b)) continue;
        if (a < b)
            meetings.push_back({a, b, &c, contact.normal});
        else
            meetings.push_back({b, a, &c, -contact.normal});
    }
    std::ranges::stable_sort(meetings, {}, [](const Meeting& o) { return std::pair(o.low, o.high); });
    return meetings;
}

bool is_deep(const ActiveContact& c) {
    double size = c.arm_a.norm();
    if (!(c.contact.b & Contact::kStatic)) size = std::min(size, c.arm_b.norm());
    return c.allowed_gap - c.contact.gap > kDeep * size;
}

void agree(std::span<Meeting> pair) {
    Vec3 sum = Vec3::Zero();
    double total = 0, fastest = 0;
    bool locked = false;
    for (const Meeting& m : pair) {
        sum += m.contact->recovery * m.normal;
        total += m.contact->recovery;
        fastest = std::max(fastest, m.contact->recovery);
        locked = locked || is_deep(*m.contact);
    }
    const double length = sum.norm();
    if (!(total > 0 && length < total)) return;  // no old overlap, or all of one mind
    const Vec3 out = sum / std::max(length, 1e-300);
    for (const Meeting& m : pair) {
        ActiveContact& c = *m.contact;
        const double along = m.normal.dot(out);
        if (!locked) {
            c.recovery = std::min(c.recovery, length / total * fastest * std::max(along, 0.0));
        } else if (c.recovery > 0) {
            c.contact.normal = m.normal == c.contact.normal ? out : Vec3(-out);
            c.recovery = fastest;
        } else if (along < 0) {
            c.wanted_gap = -kLetPass;
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
    const auto whole = [&](uint32_t piece) {
        return piece & Contact::kStatic || (b.pieces[piece].unbroken && !b.pieces[piece].rigid);
    };
    for (ActiveContact& c : io_contacts) c.wanted_gap = 0;
    std::vector<Meeting> meetings = sorted_by_pair(b.piece, whole, io_contacts);
    for (size_t first = 0, last; first < meetings.size(); first = last) {
        for (last = first + 1; last < meetings.size() && same_pair(meetings[last], meetings[first]);) ++last;
        agree(std::span(meetings).subspan(first, last - first));
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
