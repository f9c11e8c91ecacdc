#include "solver/matching/thin_groups.h"

namespace sunder {

bool bends(const SimulationMesh& rest, std::span<const Material> materials, ParticleIndex g) {
    return !rest.thin.empty() && rest.thin[g] != 0 && materials[rest.material_of(g)].curvature;
}

bool bends(const SimulationMesh& rest, std::span<const Material> materials) {
    for (size_t g = 0; g < rest.n_particles(); ++g)
        if (bends(rest, materials, g)) return true;
    return false;
}

void add_bending(const SimulationMesh& rest, std::span<const Material> materials, FrameState& io_state) {
    if (!bends(rest, materials)) return;
    if (io_state.plastic_curvature.empty()) {
        io_state.plastic_curvature.assign(rest.n_particles(), Mat3::Zero());
        io_state.layer_strain.assign(rest.n_particles(), LayerStrain());
    }
    if (io_state.yielding_rate.empty()) io_state.yielding_rate.assign(rest.n_particles(), 0);
    if (io_state.edge_offset.empty()) io_state.edge_offset.assign(rest.n_edges(), EdgeOffsets());
}

}  // namespace sunder
