#include "solver/scene/live_topology.h"

#include <algorithm>
#include <numeric>

#include "solver/data/disjoint_sets.h"
#include "solver/data/ids.h"
#include "solver/data/invariant.h"

namespace sunder {

void LiveTopology::reset(const SimulationMesh& rest, std::span<const uint8_t> edge_intact) {
    reset(rest, edge_intact, WorkerPool(1));
}

void LiveTopology::reset(const SimulationMesh& rest, std::span<const uint8_t> edge_intact, const WorkerPool& workers) {
    constexpr size_t kGrain = 256;  // fewest groups a thread is worth waking for
    const size_t n = rest.n_particles(), n_slots = rest.group_member.size();
    SUNDER_ASSERT(edge_intact.size() == rest.n_edges() && rest.group_offset.size() == n + 1);
    SUNDER_ASSERT(rest.group_offset.back() == n_slots);
    SUNDER_ASSERT(rest.member_edge.size() == n_slots && rest.member_twin.size() == n_slots);
    offset_ = rest.group_offset;
    gone_.assign(rest.n_edges(), 0);
    end_.resize(n), place_.resize(n_slots);
    member_.resize(n_slots), edge_.resize(n_slots), twin_.resize(n_slots);
    const auto for_slots = [&](const auto& body) {  // (group, slot) of those whose edge is there
        workers.for_range(n, kGrain, [&](size_t first, size_t last) {
            for (size_t g = first; g < last; ++g)
                for (uint32_t s = offset_[g]; s < offset_[g + 1]; ++s)
                    if (const EdgeId e = rest.member_edge[s]; e.is_none() || edge_intact[e]) body(g, s);
        });
    };
    std::copy(offset_.begin(), offset_.end() - 1, end_.begin());
    for_slots([&](size_t g, uint32_t s) { place_[s] = end_[g]++; });
    for_slots([&](size_t, uint32_t s) {
        const uint32_t to = place_[s];
        member_[to] = rest.group_member[s], edge_[to] = rest.member_edge[s];
        twin_[to] = rest.member_edge[s].is_none() ? to : place_[rest.member_twin[s]];
    });
    find_pieces();
}

void LiveTopology::drop_from_group(ParticleId g) {
    uint32_t to = offset_[g];
    for (uint32_t s = offset_[g]; s < end_[g]; ++s) {
        if (!edge_[s].is_none() && gone_[edge_[s]]) continue;
        member_[to] = member_[s], edge_[to] = edge_[s];
        // The slot moved: tell its twin (the centre's slot is its own twin).
        if (edge_[s].is_none()) {
            twin_[to] = to;
        } else {
            twin_[to] = twin_[s];
            twin_[twin_[to]] = to;
        }
        ++to;
    }
    end_[g] = to;
}

std::vector<ParticleId> LiveTopology::remove_edges(const SimulationMesh& rest, std::span<const EdgeId> broken) {
    std::vector<ParticleId> groups;
    for (const EdgeId e : broken) {
        SUNDER_ASSERT(e < gone_.size());
        gone_[e] = 1;
        groups.push_back(rest.edges[e].a), groups.push_back(rest.edges[e].b);
    }
    std::sort(groups.begin(), groups.end());
    groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
    for (const ParticleId g : groups) drop_from_group(g);
    for (const EdgeId e : broken) gone_[e] = 0;
    if (!groups.empty()) find_pieces();
    return groups;
}

bool LiveTopology::joined(ParticleIndex i, ParticleIndex j) const {
    const auto first = member_.begin() + offset_[i], last = member_.begin() + end_[i];
    return std::binary_search(first, last, ParticleId(size_t{j}));
}

// Numbered by their lowest particles.
void LiveTopology::find_pieces() {
    ++version_;
    const uint32_t n = static_cast<uint32_t>(end_.size());
    piece_.resize(n), piece_particle_.resize(n), set_.resize(n);
    std::iota(set_.begin(), set_.end(), 0u);
    for (uint32_t i = 0; i < n; ++i)
        for (uint32_t s = offset_[i]; s < end_[i]; ++s)
            if (member_[s] > i) unite(set_, i, member_[s]);
    piece_offset_.assign(1, 0);
    for (uint32_t i = 0; i < n; ++i) {
        const bool is_lowest = set_[i] == i;
        piece_[i] = is_lowest ? PieceId(n_pieces()) : piece_[set_[i]];  // lower ones have their numbers
        if (is_lowest) piece_offset_.push_back(0);
        ++piece_offset_[piece_[i] + 1];
    }
    std::partial_sum(piece_offset_.begin(), piece_offset_.end(), piece_offset_.begin());
    std::vector<uint32_t> next(piece_offset_.begin(), piece_offset_.end() - 1);
    for (uint32_t i = 0; i < n; ++i) piece_particle_[next[piece_[i]]++] = ParticleId(i);
}

}  // namespace sunder
