#include "solver/collision/contact_islands.h"

#include <algorithm>
#include <numeric>

namespace sunder {
namespace {

constexpr int kPasses = 60, kHingedPasses = 12;
constexpr size_t kGrain = 16;  // fewest contacts a thread is worth waking for

struct Impulses {
    double normal = 0;
    Vec3 friction = Vec3::Zero(), rolling = Vec3::Zero();
};

Impulses impulses_of(const ActiveContact& c) { return {c.normal_impulse, c.friction_impulse, c.rolling_impulse}; }

Impulses sum(const Impulses& p, double share, const Impulses& q) {
    return {p.normal + share * q.normal, p.friction + share * q.friction, p.rolling + share * q.rolling};
}

// Squared length of a change, as a displacement weighs it, kg m2.
double size(const ActiveContact& c, const Impulses& p) {
    const double rolling = c.rolling_arm > 0 ? p.rolling.squaredNorm() / (c.rolling_arm * c.rolling_arm) : 0;
    return c.inverse_mass_normal * (p.normal * p.normal + p.friction.squaredNorm() + rolling);
}

double pass_over(const ContactBodies& b, std::span<const uint32_t> island, std::span<ActiveContact> io_contacts) {
    double largest = 0;
    for (const uint32_t k : island) largest = std::max(largest, solve_contact(b, io_contacts[k]));
    return largest;
}

// A pass is a step down the gradient; as much of the last direction is added to it as the steps' shrinking allows.
void accelerate(const ContactBodies& b, std::span<const uint32_t> island, double enough,
                std::span<ActiveContact> io_contacts) {
    std::vector<Impulses> before(island.size()), direction(island.size());
    double last = 0;
    for (int pass = 0; pass < kPasses; ++pass) {
        for (size_t k = 0; k < island.size(); ++k) before[k] = impulses_of(io_contacts[island[k]]);
        if (pass_over(b, island, io_contacts) < enough) return;
        double now = 0;
        for (size_t k = 0; k < island.size(); ++k) {
            before[k] = sum(impulses_of(io_contacts[island[k]]), -1, before[k]);  // the change
            now += size(io_contacts[island[k]], before[k]);
        }
        if (pass + 1 == kPasses) return;
        const bool grows = pass > 0 && now > last;
        const double share = pass > 0 ? now / last : 0;
        last = now;
        for (size_t k = 0; k < island.size(); ++k) {
            Impulses& d = direction[k];
            if (share > 0 && !grows)
                add_impulses(b, share * d.normal, share * d.friction, share * d.rolling, io_contacts[island[k]]);
            d = grows ? Impulses() : sum(before[k], share, d);
        }
    }
}

bool is_hinged(const ContactBodies& b, uint32_t i) {
    const ContactPiece& p = b.pieces[b.piece[i]];
    return !p.rigid && !p.unbroken;
}

}  // namespace

void find_islands(const ContactBodies& b, std::span<ActiveContact> io_contacts, ContactIslands& o_islands) {
    std::vector<uint32_t> parent(b.pieces.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](uint32_t i) {
        uint32_t p = b.piece[i];
        while (parent[p] != p) p = parent[p] = parent[parent[p]];
        return p;
    };
    for (const ActiveContact& c : io_contacts)
        if (!(c.contact.b & Contact::kStatic)) {
            const uint32_t p = root(c.contact.a), q = root(c.contact.b);
            parent[std::max(p, q)] = std::min(p, q);
        }
    constexpr uint32_t kNone = 0xffffffffu;
    std::vector<uint32_t> number(b.pieces.size(), kNone), island(io_contacts.size());
    std::vector<uint8_t> hinged(b.pieces.size(), 0);  // by root
    o_islands.offset.assign(1, 0);
    for (size_t k = 0; k < io_contacts.size(); ++k) {
        const Contact& c = io_contacts[k].contact;
        const uint32_t r = root(c.a);
        if (number[r] == kNone) {
            number[r] = static_cast<uint32_t>(o_islands.size());
            o_islands.offset.push_back(0);
        }
        island[k] = number[r];
        ++o_islands.offset[island[k] + 1];
        hinged[r] |= is_hinged(b, c.a) || (!(c.b & Contact::kStatic) && is_hinged(b, c.b));
    }
    std::partial_sum(o_islands.offset.begin(), o_islands.offset.end(), o_islands.offset.begin());
    std::vector<uint32_t> next(o_islands.offset.begin(), o_islands.offset.end() - 1);
    o_islands.contact.resize(io_contacts.size());
    for (uint32_t k = 0; k < io_contacts.size(); ++k) {
        o_islands.contact[next[island[k]]++] = k;
        io_contacts[k].has_hinges = hinged[root(io_contacts[k].contact.a)];
    }
}

void relax_contacts(const ContactBodies& b, const ContactIslands& islands, double enough, const WorkerPool& workers,
                    std::span<ActiveContact> io_contacts) {
    // Threads share out contacts, and take the islands that begin among theirs.
    const auto island_from = [&](size_t contact) {
        return static_cast<size_t>(std::ranges::lower_bound(islands.offset, contact) - islands.offset.begin());
    };
    workers.for_range(io_contacts.size(), kGrain, [&](size_t first, size_t last) {
        for (size_t n = island_from(first), end = island_from(last); n < end; ++n) {
            if (!io_contacts[islands.of(n).front()].has_hinges) {
                accelerate(b, islands.of(n), enough, io_contacts);
                continue;
            }
            for (int pass = 0; pass < kHingedPasses; ++pass)
                if (pass_over(b, islands.of(n), io_contacts) < enough) break;
        }
    });
}

}  // namespace sunder
