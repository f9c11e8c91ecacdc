#include "solver/contacts/solve/contact_batches.h"

#include <algorithm>
#include <bit>

#include "solver/data/invariant.h"

namespace sunder {
namespace {

constexpr uint32_t kLanes = 8, kOpen = 64;
static_assert(kOpen == 64, "open batches are the bits of a word, and rotate in it");

// The batches of an island that have room, one a bit.
class OpenBatches {
public:
    explicit OpenBatches(std::span<uint64_t> io_taken) : taken_(io_taken) {}

    /// Lane of the island's batches for `m`.
    uint32_t put(const BatchMember& m) {
        uint64_t clashes = 0;
        for (uint32_t thing : m.touches)
            if (thing != kNone) clashes |= taken_[thing];
        // The longest open ones first; they begin at `next_`.
        const uint64_t fits = std::rotr(open_ & ~clashes, static_cast<int>(next_));
        const uint32_t k = fits ? (static_cast<uint32_t>(std::countr_zero(fits)) + next_) % kOpen : begin_batch();
        Batch& batch = batches_[k];
        for (uint32_t thing : m.touches) {
            if (thing == kNone) continue;
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

void ContactBatches::open(size_t n_members, size_t n_islands, size_t n_things) {
    taken_.resize(n_things, 0);  // nothing is open between rounds
    count_.assign(n_islands, 0);
    lane.resize(n_members);
}

void ContactBatches::form(IslandId island, std::span<const BatchMember> members, uint32_t first) {
    SUNDER_ASSERT(island < count_.size() && first + members.size() <= lane.size());
    OpenBatches open(taken_);
    std::fill_n(lane.begin() + first, members.size(), kNone);
    for (const BatchMember::Kind kind : {BatchMember::Kind::pushes, BatchMember::Kind::idle})
        for (uint32_t k = 0; k < members.size(); ++k)
            if (members[k].kind == kind) lane[first + k] = open.put(members[k]);
    count_[island] = open.finish();
}

void ContactBatches::lay_out() {
    offset.assign(1, 0);
    for (uint32_t n : count_) offset.push_back(offset.back() + n);
    member.resize(size_t{kLanes} * offset.back());
}

void ContactBatches::place(IslandId island, uint32_t first, uint32_t end) {
    SUNDER_ASSERT(island + size_t{1} < offset.size() && first <= end && end <= lane.size());
    const uint32_t begin = kLanes * offset[island];
    std::fill(member.begin() + begin, member.begin() + kLanes * offset[island + 1], kNone);
    for (uint32_t k = first; k < end; ++k)
        if (lane[k] != kNone) member[lane[k] += begin] = k;
}

}  // namespace sunder
