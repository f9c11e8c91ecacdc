#include "solver/data/thin_fragments.h"

#include <Eigen/Eigenvalues>

namespace sunder {
namespace {

constexpr double kFlat = 0.35;  // of the largest moment: walls two fragments thick have 0.27, those inside a ball 0.5

// Neighbours by edges at rest, and these.
template <class Visit>
void visit_neighbours(const SimulationMesh& rest, ParticleIndex g, const Visit& visit) {
    for (uint32_t s = rest.group_offset[g]; s < rest.group_offset[g + 1]; ++s)
        if (!rest.member_edge[s].is_none()) visit(rest.group_member[s], rest.edges[rest.member_edge[s]]);
}

Cover cover_at_rest(const SimulationMesh& rest, ParticleIndex g) {
    Cover cover(rest, g);
    visit_neighbours(rest, g, [&](ParticleId j, const Edge& edge) { cover.add(rest, g, j, edge.area); });
    return cover;
}

}  // namespace

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

std::vector<uint8_t> thin_groups(const SimulationMesh& rest) {
    std::vector<uint8_t> uncovered(rest.n_particles(), 0);
    for (uint32_t g = 0; g < uncovered.size(); ++g) {
        const Cover cover = cover_at_rest(rest, g);
        // A box of its radii holds a fragment, or nearly: what radii do not tell the size of is no sheet.
        uncovered[g] = cover.directions() < 3 && rest.volume[g] < 16 * rest.radii[g].prod();
        for (int k = 0; k < 3; ++k)
            if (!cover.spans(k) && !cover.is_free(k)) uncovered[g] = 0;
    }
    std::vector<uint8_t> thin(uncovered.size(), 0);
    for (uint32_t g = 0; g < thin.size(); ++g) {
        int n = 0, n_uncovered = 0;
        visit_neighbours(rest, g, [&](ParticleId j, const Edge&) { ++n, n_uncovered += uncovered[j]; });
        thin[g] = uncovered[g] && n > 0 && 2 * n_uncovered >= n;
    }
    return thin;
}

std::vector<uint8_t> flat_groups(const SimulationMesh& rest) {
    std::vector<uint8_t> flat(rest.n_particles(), 0);
    for (uint32_t g = 0; g < flat.size(); ++g) {
        Vec3 sum = Vec3::Zero();  // of places from its centre, m
        Mat3 moments = Mat3::Zero();
        int n = 1;
        visit_neighbours(rest, g, [&](ParticleId j, const Edge&) {
            const Vec3 d = rest.rest_position[j] - rest.rest_position[g];
            sum += d, moments += d * d.transpose(), ++n;
        });
        moments -= sum * sum.transpose() / n;
        const Eigen::SelfAdjointEigenSolver<Mat3> principal(moments, Eigen::EigenvaluesOnly);
        flat[g] = principal.eigenvalues()(0) < kFlat * principal.eigenvalues()(2);
    }
    return flat;
}

std::vector<Mat3> across_thickness(const SimulationMesh& rest) {
    std::vector<Mat3> across(rest.n_particles(), Mat3::Zero());
    const std::vector<uint8_t> thin = thin_groups(rest);
    for (uint32_t g = 0; g < across.size(); ++g) {
        if (!thin[g]) continue;
        const Cover cover = cover_at_rest(rest, g);
        const Mat3 axes = rest.rest_orientation[g].toRotationMatrix();
        for (int k = 0; k < 3; ++k)
            if (!cover.spans(k)) across[g] += axes.col(k) * axes.col(k).transpose();
    }
    return across;
}

}  // namespace sunder
