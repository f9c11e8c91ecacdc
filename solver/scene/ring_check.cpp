#include "solver/scene/ring_check.h"

namespace sunder {

bool rings_match_edges(const LiveTopology& live, const SimulationMesh& rest, std::span<const uint8_t> edge_intact) {
    for (uint32_t g = 0; g < rest.n_particles(); ++g) {
        uint32_t s = live.begin(g);
        for (uint32_t r = rest.group_offset[g]; r < rest.group_offset[g + 1]; ++r) {
            const EdgeId e = rest.member_edge[r];
            if (!e.is_none() && !edge_intact[e]) continue;
            if (s == live.end(g) || live.member(s) != rest.group_member[r] || live.edge(s) != e) return false;
            const uint32_t twin = live.twin(s);
            const ParticleId j = live.member(s);
            if (live.member(twin) != g || live.twin(twin) != s || live.piece(j) != live.piece(g)) return false;
            ++s;
        }
        if (s != live.end(g)) return false;
    }
    return true;
}

}  // namespace sunder
