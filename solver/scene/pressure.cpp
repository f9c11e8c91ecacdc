#include "solver/scene/pressure.h"

#include "solver/data/disjoint_sets.h"

namespace sunder {

double pressure_left(const Pressure& gas, const SimulationMesh& rest, const FrameState& state,
                     std::span<const uint8_t> asleep, uint32_t body) {
    std::vector<uint32_t> pieces = disjoint_sets(rest.n_particles());
    for (size_t e = 0; e < rest.n_edges(); ++e)
        if (state.edge_intact[e]) unite(pieces, rest.edges[e].a, rest.edges[e].b);
    // Of pieces, by the fragment of the lowest particle, m2. Summed by fragments, so that it is the same to the bit
    // whichever sleepers are in this part of the scene.
    std::vector<Vec3> opening = *gas.lining;
    for (uint32_t i = 0; i < rest.n_particles(); ++i) {
        if (rest.body[i] != body || (!asleep.empty() && asleep[i])) continue;
        const Vec3& own = (*gas.lining)[rest.fragment[i]];
        opening[rest.fragment[i]] = Vec3::Zero();
        opening[rest.fragment[lowest(pieces, i)]] +=
            state.orientation[i] * (rest.rest_orientation[i].conjugate() * own);
    }
    double open = 0;  // m2
    for (const Vec3& of_piece : opening) open += of_piece.norm() / 2;
    const double share = open / (gas.vent * gas.area);
    return 1 / (1 + share * share);
}

}  // namespace sunder
