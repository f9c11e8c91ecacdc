#include "solver/live_topology.h"

#include <algorithm>

namespace sunder {

void LiveTopology::reset(const SimulationMesh& rest, std::span<const uint8_t> edge_intact) {
    offset_ = rest.group_offset;
    end_.assign(offset_.begin() + 1, offset_.end());
    member_ = rest.group_member;
    edge_ = rest.member_edge;
    twin_ = rest.member_twin;
    gone_.assign(rest.n_edges(), 0);
    for (size_t e = 0; e < gone_.size(); ++e) gone_[e] = !edge_intact[e];
    for (uint32_t g = 0; g < rest.n_particles(); ++g) drop_from_group(g, gone_);
    std::fill(gone_.begin(), gone_.end(), uint8_t{0});
    find_pieces();
}

void LiveTopology::drop_from_group(uint32_t g, std::span<const uint8_t> gone) {
    uint32_t to = offset_[g];
    for (uint32_t s = offset_[g]; s < end_[g]; ++s) {
        if (edge_[s] != SimulationMesh::kNone && gone[edge_[s]]) continue;
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
    for (uint32_t g : groups) drop_from_group(g, gone_);
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
    piece_particle_.clear();
    piece_offset_.assign(1, 0);
    for (uint32_t seed = 0; seed < n; ++seed) {
        if (piece_[seed] != SimulationMesh::kNone) continue;
        const uint32_t piece = static_cast<uint32_t>(piece_offset_.size() - 1);
        const size_t first = piece_particle_.size();
        piece_[seed] = piece;
        piece_particle_.push_back(seed);
        for (size_t next = first; next < piece_particle_.size(); ++next) {
            const uint32_t i = piece_particle_[next];
            for (uint32_t s = offset_[i]; s < end_[i]; ++s)
                if (piece_[member_[s]] == SimulationMesh::kNone) {
                    piece_[member_[s]] = piece;
                    piece_particle_.push_back(member_[s]);
                }
        }
        std::sort(piece_particle_.begin() + first, piece_particle_.end());
        piece_offset_.push_back(static_cast<uint32_t>(piece_particle_.size()));
    }
}

}  // namespace sunder
