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
    std::vector<uint8_t> uncovered(rest.n_particles(), 0);
    const auto neighbours = [&](uint32_t g, const auto& visit) {
        for (uint32_t s = rest.group_offset[g]; s < rest.group_offset[g + 1]; ++s)
            if (!rest.member_edge[s].is_none()) visit(rest.group_member[s], rest.edges[rest.member_edge[s]]);
    };
    for (uint32_t g = 0; g < uncovered.size(); ++g) {
        Cover cover(rest, g);
        neighbours(g, [&](ParticleId j, const Edge& edge) { cover.add(rest, g, j, edge.area); });
        // A box of its radii holds a fragment, or nearly: what radii do not tell the size of is no sheet.
        uncovered[g] = cover.directions() < 3 && rest.volume[g] < 16 * rest.radii[g].prod();
        for (int k = 0; k < 3; ++k)
            if (!cover.spans(k) && !cover.is_free(k)) uncovered[g] = 0;
    }
    std::vector<uint8_t> thin(uncovered.size(), 0);
    for (uint32_t g = 0; g < thin.size(); ++g) {
        int n = 0, n_uncovered = 0;
        neighbours(g, [&](ParticleId j, const Edge&) { ++n, n_uncovered += uncovered[j]; });
        thin[g] = uncovered[g] && n > 0 && 2 * n_uncovered >= n;
    }
    return thin;
}

}  // namespace sunder
