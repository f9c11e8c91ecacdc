#include "solver/scene/pressure.h"

#include "solver/data/disjoint_sets.h"

namespace sunder {

double pressure_left(const Pressure& gas, const SimulationMesh& rest, const FrameState& state, uint32_t body) {
    std::vector<uint32_t> pieces = disjoint_sets(rest.n_particles());
    for (size_t e = 0; e < rest.n_edges(); ++e)
        if (state.edge_intact[e] && rest.body[rest.edges[e].a] == body) unite(pieces, rest.edges[e].a, rest.edges[e].b);
    std::vector<Vec3> lining(rest.n_particles(), Vec3::Zero());  // by the piece's lowest particle, m2
    for (uint32_t i = 0; i < rest.n_particles(); ++i)
        if (rest.body[i] == body)
            lining[lowest(pieces, i)] +=
                state.orientation[i] * (rest.rest_orientation[i].conjugate() * (*gas.lining)[rest.fragment[i]]);
    double open = 0;  // m2
    for (const Vec3& own : lining) open += own.norm() / 2;
    const double share = open / (gas.vent * gas.area);
    return 1 / (1 + share * share);
}

}  // namespace sunder
