#include "solver/live_topology.h"

#include <algorithm>

namespace sunder {

void LiveTopology::reset(const SimulationMesh& rest, std::span<const uint8_t> edge_intact) {
    reset(rest, edge_intact, WorkerPool(1));
}

void LiveTopology::reset(const SimulationMesh& rest, std::span<const uint8_t> edge_intact, const WorkerPool& workers) {
    constexpr size_t kGrain = 256;  // fewest groups a thread is worth waking for
    constexpr uint32_t kNone = SimulationMesh::kNone;
    const size_t n = rest.n_particles(), n_slots = rest.group_member.size();
    offset_ = rest.group_offset;
    gone_.assign(rest.n_edges(), 0);
    end_.resize(n), place_.resize(n_slots);
    member_.resize(n_slots), edge_.resize(n_slots), twin_.resize(n_slots);
    const auto for_slots = [&](const auto& body) {  // (group, slot) of those whose edge is there
        workers.for_range(n, kGrain, [&](size_t first, size_t last) {
            for (size_t g = first; g < last; ++g)
                for (uint32_t s = offset_[g]; s < offset_[g + 1]; ++s)
                    if (const uint32_t e = rest.member_edge[s]; e == kNone || edge_intact[e]) body(g, s);
        });
    };
    std::copy(offset_.begin(), offset_.end() - 1, end_.begin());
    for_slots([&](size_t g, uint32_t s) { place_[s] = end_[g]++; });
    for_slots([&](size_t, uint32_t s) {
        const uint32_t to = place_[s];
        member_[to] = rest.group_member[s], edge_[to] = rest.member_edge[s];
        twin_[to] = rest.member_edge[s] == kNone ? to : place_[rest.member_twin[s]];
    });
    find_pieces();
}

void LiveTopology::drop_from_group(uint32_t g) {
    uint32_t to = offset_[g];
    for (uint32_t s = offset_[g]; s < end_[g]; ++s) {
        if (edge_[s] != SimulationMesh::kNone && gone_[edge_[s]]) continue;
        member_[to] = member_[s], edge_[to] = edge_[s];
        // The slot moved: tell its twin (the centre's slot is its own twin).
        if (edge_[s] == SimulationMesh::kNone) {
            twin_[to] = to;
        } else {
            twin_[to] = twin_[s];
            twin_[twin_[to]] = to;
        }
        ++to;
    }
    end_[g] = to;
}

std::vector<uint32_t> LiveTopology::remove_edges(const SimulationMesh& rest, std::span<const uint32_t> broken) {
    std::vector<uint32_t> groups;
    for (uint32_t e : broken) {
        gone_[e] = 1;
        groups.push_back(rest.edges[e].a), groups.push_back(rest.edges[e].b);
    }
    std::sort(groups.begin(), groups.end());
    groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
    for (uint32_t g : groups) drop_from_group(g);
    for (uint32_t e : broken) gone_[e] = 0;
    if (!groups.empty()) find_pieces();
    return groups;
}

bool LiveTopology::joined(uint32_t i, uint32_t j) const {
    const auto first = member_.begin() + offset_[i], last = member_.begin() + end_[i];
    return std::binary_search(first, last, j);
}

void LiveTopology::find_pieces() {
    ++version_;
    const uint32_t n = static_cast<uint32_t>(end_.size());
    piece_.assign(n, SimulationMesh::kNone);
    piece_particle_.resize(n);
    piece_offset_.assign(1, 0);
    uint32_t* const particle = piece_particle_.data();
    uint32_t found = 0;
    for (uint32_t seed = 0; seed < n; ++seed) {
        if (piece_[seed] != SimulationMesh::kNone) continue;
        const uint32_t piece = static_cast<uint32_t>(piece_offset_.size() - 1), first = found;
        piece_[seed] = piece;
        particle[found++] = seed;
        for (uint32_t next = first; next < found; ++next) {
            const uint32_t i = particle[next];
            for (uint32_t s = offset_[i]; s < end_[i]; ++s) {
                const uint32_t j = member_[s];
                if (piece_[j] == SimulationMesh::kNone) piece_[j] = piece, particle[found++] = j;
            }
        }
        if (found - first > 2) std::sort(particle + first, particle + found);  // two come in order
        piece_offset_.push_back(found);
    }
}

}  // namespace sunder
