#include "solver/matching/thin_groups.h"

namespace sunder {

uint8_t bending_kind(const SimulationMesh& rest, std::span<const Material> materials, ParticleIndex g) {
    return rest.thin.empty() ? 0 : bending_kind(rest.thin[g], materials[rest.material_of(g)]);
}

bool bends(const SimulationMesh& rest, std::span<const Material> materials) {
    for (size_t g = 0; g < rest.n_particles(); ++g)
        if (bending_kind(rest, materials, g) != 0) return true;
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
