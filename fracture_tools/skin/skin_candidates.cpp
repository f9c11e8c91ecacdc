#include "fracture_tools/skin/skin_candidates.h"

#include <algorithm>
#include <map>

#include "solver/data/thin_fragments.h"

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

// Members of a particle's ring at rest, each with the edges that it needs: its own, or all ways by a third particle.
std::map<uint32_t, std::vector<uint32_t>> gates_of(const SimulationMesh& rest, uint32_t particle, bool is_thin) {
    std::map<uint32_t, std::vector<uint32_t>> gates;
    const auto visit = [&](uint32_t i, const auto& neighbour) {
        for (uint32_t s = rest.group_offset[i]; s < rest.group_offset[i + 1]; ++s)
            if (rest.member_edge[s] != kNone) neighbour(rest.group_member[s].value, rest.member_edge[s].value);
    };
    gates[particle];
    visit(particle, [&](uint32_t j, uint32_t edge) { gates[j] = {edge}; });
    if (!is_thin) return gates;
    std::map<uint32_t, std::vector<uint32_t>> second;
    visit(particle, [&](uint32_t j, uint32_t edge) {
        visit(j, [&](uint32_t k, uint32_t next_edge) {
            if (!gates.contains(k)) second[k].insert(second[k].end(), {edge, next_edge});
        });
    });
    gates.merge(second);
    return gates;
}

}  // namespace

IntactRings::IntactRings(const SimulationMesh& rest)
    : edges_(rest.edges), member_offset_{0}, ring_size_(rest.n_particles(), 0) {
    const std::vector<uint8_t> thin = thin_groups(rest);
    for (uint32_t i = 0; i < rest.n_particles(); ++i) {
        for (const auto& [member, gates] : gates_of(rest, i, thin[i])) {
            member_.push_back(member);
            gate_.insert(gate_.end(), gates.begin(), gates.end());
            gate_offset_.push_back(static_cast<uint32_t>(gate_.size()));
        }
        member_offset_.push_back(static_cast<uint32_t>(member_.size()));
    }
    ring_.resize(member_.size());
}

bool IntactRings::is_joined(uint32_t member) const {
    for (uint32_t g = gate_offset_[member]; g < gate_offset_[member + 1]; ++g)
        if (!edge_intact_[gate_[g]]) return false;
    return true;
}

void IntactRings::update(std::span<const uint8_t> edge_intact) {
    changed_.assign(n_particles(), edge_intact_.empty());
    std::vector<uint8_t> edge_changed(edge_intact.size(), 0);
    for (size_t e = 0; e < edge_intact_.size(); ++e) edge_changed[e] = bool(edge_intact[e]) != bool(edge_intact_[e]);
    edge_intact_.assign(edge_intact.begin(), edge_intact.end());
    for (size_t i = 0; i < n_particles(); ++i) {
        const uint32_t begin = member_offset_[i], last = member_offset_[i + 1];
        for (uint32_t g = gate_offset_[begin]; g < gate_offset_[last]; ++g) changed_[i] |= edge_changed[gate_[g]];
        if (!changed_[i]) continue;
        uint32_t end = begin;
        for (uint32_t m = begin; m < last; ++m)
            if (is_joined(m)) ring_[end++] = member_[m];
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
