#include "solver/data/thin_fragments.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "solver/data/math_functions.h"

namespace sunder {
namespace {

constexpr double kFlat = 0.35;  // of the largest moment: walls two fragments thick have 0.27, those inside a ball 0.5

constexpr double kBare = 0.3;  // of a face of a cube: what of a surface fragment's no neighbour covers, in sum
constexpr uint8_t kDeep = 3;   // of fragments with two others between them and the surface
constexpr double kOfCore = 4;  // of a fragment's size: from the corner of a block to its first deep fragment
constexpr double kLong = 2;    // of what lies through the thickness: how far a slender body reaches, end to end
constexpr double kReach = kLong * 2 * (kDeep - 1);  // of a fragment's size

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

// How many fragments lie between one and the surface, and itself: 1 at the surface, kDeep at most.
std::vector<uint8_t> depths(const SimulationMesh& rest) {
    std::vector<uint8_t> depth(rest.n_particles(), kDeep);
    for (uint32_t g = 0; g < depth.size(); ++g) {
        const bool is_bare = rest.bareness.empty() || rest.bareness[g] > kBare;
        if (is_bare || cover_at_rest(rest, g).directions() < 3) depth[g] = 1;
    }
    for (uint8_t from = 1; from + 1 < kDeep; ++from)
        for (uint32_t g = 0; g < depth.size(); ++g)
            if (depth[g] == from)
                visit_neighbours(rest, g,
                                 [&](ParticleId j, const Edge&) { depth[j] = std::min<uint8_t>(depth[j], from + 1); });
    return depth;
}

// 1 where a fragment is, and at least half of its neighbours are.
std::vector<uint8_t> among_their_like(const SimulationMesh& rest, const std::vector<uint8_t>& are) {
    std::vector<uint8_t> like(are.size(), 0);
    for (uint32_t g = 0; g < like.size(); ++g) {
        int n = 0, n_are = 0;
        visit_neighbours(rest, g, [&](ParticleId j, const Edge&) { ++n, n_are += are[j]; });
        like[g] = are[g] && n > 0 && 2 * n_are >= n;
    }
    return like;
}

// What hangs together with a fragment, near it.
class Surroundings {
public:
    Surroundings(const SimulationMesh& rest, const std::vector<uint8_t>& depth)
        : rest_(rest), depth_(depth), is_reached_(depth.size(), 0) {}

    bool are_slender(ParticleIndex g) {
        const double size = mean_size(g);
        uint8_t deepest = depth_[g];
        Vec3 end = rest_.rest_position[g];
        double farthest = 0;
        reached_.assign(1, g), is_reached_[g] = 1;
        for (size_t next = 0; next < reached_.size() && deepest < kDeep; ++next)
            visit_neighbours(rest_, ParticleIndex(reached_[next]), [&](ParticleId j, const Edge&) {
                if (is_reached_[j]) return;
                const double far = (rest_.rest_position[j] - rest_.rest_position[g]).norm() / size;
                if (far > farthest) farthest = far, end = rest_.rest_position[j];
                if (far < kOfCore) deepest = std::max(deepest, depth_[j]);
                if (far < kReach) is_reached_[j] = 1, reached_.push_back(j);
            });
        for (const uint32_t j : reached_) {
            is_reached_[j] = 0;
            farthest = std::max(farthest, (rest_.rest_position[j] - end).norm() / size);
        }
        return deepest < kDeep && farthest > kLong * 2 * deepest;
    }

private:
    // Of a fragment and its neighbours: a small one among large ones lies no deeper for it.
    double mean_size(ParticleIndex g) const {
        double volume = rest_.volume[g];
        int n = 1;
        visit_neighbours(rest_, g, [&](ParticleId j, const Edge&) { volume += rest_.volume[j], ++n; });
        return math::cbrt(volume / n);
    }

    const SimulationMesh& rest_;
    const std::vector<uint8_t>& depth_;
    std::vector<uint8_t> is_reached_;
    std::vector<uint32_t> reached_;
};

}  // namespace

Cover::Cover(const SimulationMesh& rest, ParticleIndex g)
    : to_axes_(rest.rest_orientation[g].conjugate().toRotationMatrix()),
      extent_per_volume_((12 * section_moments(rest, g)).cwiseSqrt() / rest.volume[g]) {}

void Cover::add(const SimulationMesh& rest, ParticleIndex g, ParticleIndex neighbour, double area) {
    const Vec3 e = to_axes_ * (rest.rest_position[neighbour] - rest.rest_position[g]).normalized();
    cover_ += area * extent_per_volume_.cwiseProduct(e.cwiseProduct(e));
    const Vec3 root = extent_per_volume_.cwiseSqrt().cwiseProduct(e);
    for (int k = 0; k < 3; ++k) between_[k] += area * root[(k + 1) % 3] * root[(k + 2) % 3];
}

bool Cover::spans_all() const {
    if (directions() < 3) return false;
    Mat3 cover = cover_.asDiagonal();
    for (int k = 0; k < 3; ++k) cover((k + 1) % 3, (k + 2) % 3) = cover((k + 2) % 3, (k + 1) % 3) = between_[k];
    const Eigen::SelfAdjointEigenSolver<Mat3> principal(cover, Eigen::EigenvaluesOnly);
    return principal.eigenvalues()[0] > kFree;
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
    return among_their_like(rest, uncovered);
}

std::vector<uint8_t> bending_groups(const SimulationMesh& rest) {
    std::vector<uint8_t> kind = thin_groups(rest), slender(kind.size(), 0);
    const std::vector<uint8_t> depth = depths(rest);
    Surroundings around(rest, depth);
    for (uint32_t g = 0; g < kind.size(); ++g) slender[g] = kind[g] || around.are_slender(g);
    const std::vector<uint8_t> bends = among_their_like(rest, slender);
    for (uint32_t g = 0; g < kind.size(); ++g)
        if (kind[g] == 0 && cover_at_rest(rest, g).spans_all()) kind[g] = bends[g] ? kSlender : kThick;
    return kind;
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
