#include "fracture_tools/skin/skin_candidates.h"

#include <algorithm>

namespace sunder {
namespace {

// Both ascend; without branches that depend on what is in them. `out` has room for both; gives where it ends.
uint32_t* unite(std::span<const uint32_t> a, std::span<const uint32_t> b, uint32_t* out) {
    size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        const uint32_t x = a[i], y = b[j];
        *out++ = std::min(x, y);
        i += x <= y, j += y <= x;
    }
    out = std::copy(a.begin() + i, a.end(), out);
    return std::copy(b.begin() + j, b.end(), out);
}

}  // namespace

void IntactRings::update(std::span<const uint8_t> edge_intact) {
    changed_.assign(n_particles(), edge_intact_.empty());
    for (size_t e = 0; e < edge_intact_.size(); ++e)
        if (bool(edge_intact[e]) != bool(edge_intact_[e])) changed_[edges_[e].a] = changed_[edges_[e].b] = 1;
    edge_intact_.assign(edge_intact.begin(), edge_intact.end());
    for (size_t i = 0; i < n_particles(); ++i) {
        if (!changed_[i]) continue;
        const uint32_t begin = group_offset_[i];
        uint32_t end = begin;
        for (uint32_t s = begin; s < group_offset_[i + 1]; ++s)
            if (member_edge_[s] == kNone || edge_intact_[member_edge_[s]]) ring_[end++] = group_member_[s];
        ring_size_[i] = end - begin;
    }
}

CandidateLists::CandidateLists(const IntactRings& rings, uint32_t multiple)
    : rings_(rings), multiple_(multiple), of_one_(rings.n_particles()), of_many_(kLists) {}

CandidateLists::List& CandidateLists::place_of(std::span<const uint32_t> connected) {
    if (connected.size() == 1) return of_one_[connected[0]];
    uint32_t hash = 0;
    for (const uint32_t i : connected) hash = 31 * hash + i;
    return of_many_[hash % kLists];
}

std::span<const uint32_t> CandidateLists::find(std::span<const uint32_t> connected) {
    constexpr size_t kMost = 1 << 14;  // entries that stay in the nearest caches
    if (listed_.size() > kMost) {
        listed_.clear();
        std::fill(of_one_.begin(), of_one_.end(), List{}), std::fill(of_many_.begin(), of_many_.end(), List{});
    }
    List& list = place_of(connected);
    const uint32_t* const known = listed_.data() + list.begin;
    bool is_known = list.n_connected == connected.size();
    for (size_t i = 0; is_known && i < connected.size(); ++i) is_known = known[i] == connected[i];
    if (!is_known) {
        list = {static_cast<uint32_t>(listed_.size()), static_cast<uint32_t>(connected.size()), 0};
        gather(connected);
        list.n_candidates = static_cast<uint32_t>(listed_.size()) - list.begin - list.n_connected;
    }
    return {listed_.data() + list.begin + list.n_connected, list.n_candidates};
}

void CandidateLists::gather(std::span<const uint32_t> connected) {
    listed_.insert(listed_.end(), connected.begin(), connected.end());
    std::span<const uint32_t> all = rings_[connected[0]];
    for (const uint32_t i : connected.subspan(1)) {
        const std::span<const uint32_t> ring = rings_[i];
        more_.resize(all.size() + ring.size());
        more_.resize(unite(all, ring, more_.data()) - more_.data());
        std::swap(united_, more_);
        all = united_;
    }
    listed_.insert(listed_.end(), all.begin(), all.end());
    const size_t fill = (multiple_ - all.size() % multiple_) % multiple_;
    listed_.insert(listed_.end(), fill, static_cast<uint32_t>(rings_.n_particles()));
}

}  // namespace sunder
