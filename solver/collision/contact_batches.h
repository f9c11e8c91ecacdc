// Contacts in eights that may be solved side by side: no two of a batch push what the other reads.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/parallel.h"

namespace sunder {

/// What a contact asks of the other seven: that they touch none of the same things.
struct BatchMember {
    static constexpr uint32_t kNone = 0xffffffffu;
    enum class Kind : uint8_t { pushes, idle, left_out };
    std::array<uint32_t, 4> touches = {kNone, kNone, kNone, kNone};
    Kind kind = Kind::left_out;
};

struct ContactBatches {
    std::vector<uint32_t> member;  // eight lanes a batch; BatchMember::kNone: empty  (8 n_batches)
    std::vector<uint32_t> offset;  // of islands, in batches                         (n_islands + 1)
    std::vector<uint32_t> lane;    // of members: 8 batch + lane, or kNone           (n_members)

    size_t size() const { return member.size() / 8; }

    /// `island_offset`: of islands in `members` (n_islands + 1); no two islands touch the same of the `n_things`. Each
    /// contact goes into the first batch that has room for it of the 64 that were begun last, those that push before
    /// those that are idle, so that batches of idle ones can be passed over.
    void form(std::span<const BatchMember> members, std::span<const uint32_t> island_offset, size_t n_things,
              const WorkerPool& workers);

private:
    std::vector<uint64_t> taken_;  // in which open batches a thing is touched (n_things)
    std::vector<uint32_t> count_;  // (n_islands)
};

}  // namespace sunder
