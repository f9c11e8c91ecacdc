#include "solver/collision/contact_batches.h"

#include <algorithm>
#include <bit>

namespace sunder {
namespace {

constexpr uint32_t kLanes = 8, kOpen = 64;
static_assert(kOpen == 64, "open batches are the bits of a word, and rotate in it");
constexpr size_t kGrain = 256;  // fewest contacts a thread is worth waking for

// The batches of an island that have room, one a bit.
class OpenBatches {
public:
    explicit OpenBatches(std::span<uint64_t> io_taken) : taken_(io_taken) {}

    /// Lane of the island's batches for `m`.
    uint32_t put(const BatchMember& m) {
        uint64_t clashes = 0;
        for (uint32_t thing : m.touches)
            if (thing != BatchMember::kNone) clashes |= taken_[thing];
        // The longest open ones first; they begin at `next_`.
        const uint64_t fits = std::rotr(open_ & ~clashes, static_cast<int>(next_));
        const uint32_t k = fits ? (static_cast<uint32_t>(std::countr_zero(fits)) + next_) % kOpen : begin_batch();
        Batch& batch = batches_[k];
        for (uint32_t thing : m.touches) {
            if (thing == BatchMember::kNone) continue;
            taken_[thing] |= uint64_t{1} << k;
            batch.things[batch.n_things++] = thing;
        }
        const uint32_t lane = kLanes * batch.number + batch.n_members++;
        if (batch.n_members == kLanes) close(k);
        return lane;
    }

    /// Closes all; the number of batches that were begun.
    uint32_t finish() {
        for (uint32_t k = 0; k < kOpen; ++k) close(k);
        return n_batches_;
    }

private:
    struct Batch {
        uint32_t number = 0, n_members = 0, n_things = 0;
        std::array<uint32_t, 4 * kLanes> things;
    };

    uint32_t begin_batch() {
        const uint32_t k = next_;
        next_ = (next_ + 1) % kOpen;
        close(k);
        open_ |= uint64_t{1} << k;
        batches_[k].number = n_batches_++;
        batches_[k].n_members = batches_[k].n_things = 0;
        return k;
    }
    void close(uint32_t k) {
        const uint64_t bit = uint64_t{1} << k;
        if (!(open_ & bit)) return;
        open_ &= ~bit;
        for (uint32_t i = 0; i < batches_[k].n_things; ++i) taken_[batches_[k].things[i]] &= ~bit;
    }

    std::span<uint64_t> taken_;
    uint64_t open_ = 0;
    uint32_t next_ = 0, n_batches_ = 0;
    std::array<Batch, kOpen> batches_;
};

}  // namespace

void ContactBatches::form(std::span<const BatchMember> members, std::span<const uint32_t> island_offset,
                          size_t n_things, const WorkerPool& workers) {
    const size_t n_islands = island_offset.size() - 1;
    taken_.assign(n_things, 0);
    count_.assign(n_islands, 0);
    lane.assign(members.size(), BatchMember::kNone);
    const auto form_island = [&](size_t n) {
        OpenBatches open(taken_);
        for (const BatchMember::Kind kind : {BatchMember::Kind::pushes, BatchMember::Kind::idle})
            for (uint32_t k = island_offset[n]; k < island_offset[n + 1]; ++k)
                if (members[k].kind == kind) lane[k] = open.put(members[k]);
        count_[n] = open.finish();
    };
    const auto island_from = [&](size_t contact) {
        return static_cast<size_t>(std::ranges::lower_bound(island_offset, contact) - island_offset.begin());
    };
    workers.for_range(members.size(), kGrain, [&](size_t first, size_t end) {
        for (size_t n = island_from(first), beyond = std::min(island_from(end), n_islands); n < beyond; ++n)
            form_island(n);
    });

    offset.assign(1, 0);
    for (uint32_t n : count_) offset.push_back(offset.back() + n);
    member.assign(size_t{kLanes} * offset.back(), BatchMember::kNone);
    for (size_t n = 0; n < n_islands; ++n)
        for (uint32_t k = island_offset[n]; k < island_offset[n + 1]; ++k)
            if (lane[k] != BatchMember::kNone) member[lane[k] += kLanes * offset[n]] = k;
}

}  // namespace sunder
