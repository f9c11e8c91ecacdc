// Contacts in eights that may be solved side by side: no two of a batch push what the other reads.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/data/ids.h"

namespace sunder {

/// What a contact asks of the other seven: that they touch none of the same things.
struct BatchMember {
    enum class Kind : uint8_t { pushes, idle, left_out };
    std::array<uint32_t, 4> touches = {kNone, kNone, kNone, kNone};
    Kind kind = Kind::left_out;
};

struct ContactBatches {
    std::vector<uint32_t> member;  // eight lanes a batch; kNone: empty     (8 n_batches)
    std::vector<uint32_t> offset;  // of islands, in batches                (n_islands + 1)
    std::vector<uint32_t> lane;    // of members: 8 batch + lane, or kNone  (n_members)

    size_t size() const { return member.size() / 8; }

    /// For as many members, islands and things that may be touched; then `form` for islands, in any order and from any
    /// threads (those left out have no batches), then `lay_out`, then `place` for each of these.
    void open(size_t n_members, size_t n_islands, size_t n_things);

    /// Batches of an island, whose contacts are `members` from `first` on; no two islands touch the same. Each contact
    /// goes into the first batch that has room for it of the 64 that were begun last, those that push before those that
    /// are idle, so that batches of idle ones can be passed over.
    void form(IslandId island, std::span<const BatchMember> members, uint32_t first);

    void lay_out();

    void place(IslandId island, uint32_t first, uint32_t end);

private:
    std::vector<uint64_t> taken_;  // in which open batches a thing is touched (n_things)
    std::vector<uint32_t> count_;  // (n_islands)
};

}  // namespace sunder
