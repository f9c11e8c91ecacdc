#include "solver/matching/thin_groups.h"

namespace sunder {

Cover::Cover(const SimulationMesh& rest, ParticleIndex g)
    : to_axes_(rest.rest_orientation[g].conjugate().toRotationMatrix()),
      extent_per_volume_((12 * section_moments(rest, g)).cwiseSqrt() / rest.volume[g]) {}

void Cover::add(const SimulationMesh& rest, ParticleIndex g, ParticleIndex neighbour, double area) {
    const Vec3 e = to_axes_ * (rest.rest_position[neighbour] - rest.rest_position[g]).normalized();
    cover_ += area * extent_per_volume_.cwiseProduct(e.cwiseProduct(e));
}

int Cover::least() const {
    int k;
    cover_.minCoeff(&k);
    return k;
}

int Cover::most() const {
    int k;
    cover_.maxCoeff(&k);
    return k;
}

bool bends(const SimulationMesh& rest, std::span<const Material> materials, ParticleIndex g) {
    return !rest.thin.empty() && rest.thin[g] != 0 && materials[rest.body[g]].curvature;
}

bool bends(const SimulationMesh& rest, std::span<const Material> materials) {
    for (size_t g = 0; g < rest.n_particles(); ++g)
        if (bends(rest, materials, g)) return true;
    return false;
}

void add_bending(const SimulationMesh& rest, std::span<const Material> materials, FrameState& io_state) {
    if (!io_state.plastic_curvature.empty() || !bends(rest, materials)) return;
    io_state.plastic_curvature.assign(rest.n_particles(), Mat3::Zero());
    io_state.layer_strain.assign(rest.n_particles(), LayerStrain());
}

std::vector<uint8_t> thin_groups(const SimulationMesh& rest) {
    std::vector<uint8_t> thin(rest.n_particles(), 0);
    for (uint32_t g = 0; g < thin.size(); ++g) {
        const uint32_t begin = rest.group_offset[g], end = rest.group_offset[g + 1];
        if (end - begin < 2) continue;
        Cover cover(rest, g);
        for (uint32_t s = begin; s < end; ++s)
            if (!rest.member_edge[s].is_none())
                cover.add(rest, g, rest.group_member[s], rest.edges[rest.member_edge[s]].area);
        thin[g] = cover.directions() < 3;
    }
    return thin;
}

}  // namespace sunder
