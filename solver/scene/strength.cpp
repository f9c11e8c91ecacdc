#include "solver/scene/strength.h"

#include <algorithm>

#include "solver/data/invariant.h"

namespace sunder {

std::vector<double> fragment_toughness(const SimulationMesh& rest, std::span<const Material> materials,
                                       std::span<const uint8_t> edge_intact) {
    SUNDER_ASSERT(edge_intact.size() == rest.n_edges());
    std::vector<double> toughness(rest.n_particles(), kNever);
    const auto offer = [&](ParticleId g, double factor) {
        const double own = material_of(rest, g, materials[rest.body[g]]).toughness;
        toughness[g] = std::min(toughness[g], rest.group_uneven[g] ? own * factor : own);
    };
    for (EdgeId e(0); e < rest.n_edges(); ++e)
        if (edge_intact[e]) {
            const Edge& edge = rest.edges[e];
            offer(edge.a, edge.toughness_factor), offer(edge.b, edge.toughness_factor);
        }
    return toughness;
}

}  // namespace sunder
