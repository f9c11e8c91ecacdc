#include "fracture_tools/skinning.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sunder {

Skin::Skin(std::vector<Vec3> rest_vertex, const SimulationMesh& rest, const SkinKernel& kernel)
    : rest_particle_(rest.rest_position),
      edges_(rest.edges),
      group_offset_(rest.group_offset),
      group_member_(rest.group_member),
      member_edge_(rest.member_edge),
      kernel_(kernel),
      ring_changed_(rest.n_particles(), 1),
      is_candidate_(rest.n_particles(), 0) {
    auto unbound = std::make_shared<SkinBinding>();
    unbound->rest_vertex = std::make_shared<const std::vector<Vec3>>(std::move(rest_vertex));
    binding_ = std::move(unbound);
    // Weighted by area: a neighbour behind a sliver of an interface says little about how far apart particles are.
    // The support is the one of the rest state also after edges broke, or weights would jump without need.
    support_.resize(rest.n_particles());
    for (uint32_t i = 0; i < rest.n_particles(); ++i) {
        double area = 0, area_length = 0, length = 0;
        uint32_t count = 0;
        for (uint32_t s = group_offset_[i]; s < group_offset_[i + 1]; ++s) {
            if (member_edge_[s] == SimulationMesh::kNone) continue;
            const double l = (rest_particle_[group_member_[s]] - rest_particle_[i]).norm();
            const double a = edges_[member_edge_[s]].area;
            area += a, area_length += a * l, length += l, ++count;
        }
        const double mean = area > 0 ? area_length / area : count > 0 ? length / count : 0;
        support_[i] = mean > 0 ? kernel_.reach * mean : 1.0;  // alone: whatever, it has no rival
    }
}

void Skin::mark_changed_rings(std::span<const uint8_t> edge_intact) {
    std::fill(ring_changed_.begin(), ring_changed_.end(), edge_intact_.empty());
    for (size_t e = 0; e < edge_intact_.size(); ++e)
        if (bool(edge_intact[e]) != bool(edge_intact_[e])) ring_changed_[edges_[e].a] = ring_changed_[edges_[e].b] = 1;
    edge_intact_.assign(edge_intact.begin(), edge_intact.end());
}

void Skin::bind(const SplitTopology& topology, std::span<const uint8_t> edge_intact) {
    mark_changed_rings(edge_intact);
    const uint32_t n = static_cast<uint32_t>(topology.n_vertices());
    const SkinBinding& old = *binding_;
    auto next = std::make_shared<SkinBinding>();
    next->rest_vertex = old.rest_vertex;
    next->pool_vertex.resize(n), next->nearest.resize(n);
    next->influence.reserve(old.influence.size() + old.influence.size() / 8);
    next->influence_offset.reserve(n + 1);
    std::vector<uint32_t> connected;
    std::vector<SkinBinding::Influence> weights;
    for (uint32_t v = 0; v < n; ++v) {
        next->pool_vertex[v] = topology.pool_vertex(v);
        topology.connected_fragments(v, connected);
        const uint32_t before = topology.previous_vertex(v);
        const bool changed =
            before == SplitTopology::kNone || before >= old.n_vertices() ||
            std::any_of(connected.begin(), connected.end(), [&](uint32_t i) { return ring_changed_[i]; });
        if (!changed) {
            next->nearest[v] = old.nearest[before];
            const auto kept = old.influences(before);
            next->influence.insert(next->influence.end(), kept.begin(), kept.end());
        } else {
            const Vec3& x = next->rest_position(v);
            next->nearest[v] = *std::min_element(connected.begin(), connected.end(), [&](uint32_t i, uint32_t j) {
                return (rest_particle_[i] - x).squaredNorm() < (rest_particle_[j] - x).squaredNorm();
            });
            find_candidates(connected, edge_intact);
            weigh(x, weights);
            next->influence.insert(next->influence.end(), weights.begin(), weights.end());
        }
        next->influence_offset.push_back(static_cast<uint32_t>(next->influence.size()));
    }
    binding_ = std::move(next);
}

// Ascending, so that sums over them are taken in the same order on every way to the same state.
void Skin::find_candidates(const std::vector<uint32_t>& connected, std::span<const uint8_t> edge_intact) {
    candidate_.clear();
    for (uint32_t i : connected)
        for (uint32_t s = group_offset_[i]; s < group_offset_[i + 1]; ++s) {
            const uint32_t j = group_member_[s];
            if (is_candidate_[j] || (member_edge_[s] != SimulationMesh::kNone && !edge_intact[member_edge_[s]]))
                continue;
            is_candidate_[j] = 1;
            candidate_.push_back(j);
        }
    std::sort(candidate_.begin(), candidate_.end());
    for (uint32_t j : candidate_) is_candidate_[j] = 0;
}

void Skin::weigh(const Vec3& x, std::vector<SkinBinding::Influence>& out) {
    out.clear();
    double closest = std::numeric_limits<double>::infinity();  // in supports
    for (uint32_t j : candidate_) {
        const double t = (rest_particle_[j] - x).norm() / support_[j];
        closest = std::min(closest, t);
        out.push_back({j, t});
    }
    // Far out (a spike, a long thin piece) the supports grow with the distance, so that the nearest always has a say.
    constexpr double kFarOut = 0.75;
    const double grow = std::max(1.0, closest / kFarOut);
    double sum = 0;
    std::erase_if(out, [&](const SkinBinding::Influence& i) { return i.weight >= grow; });
    for (SkinBinding::Influence& i : out) {
        const double t = i.weight / grow, k = 1 - t * t;
        i.weight = k * k * k;
        sum += i.weight;
    }
    for (SkinBinding::Influence& i : out) i.weight /= sum;
}

void Skin::blend(std::span<const Affine> particle, std::vector<Affine>& out) const {
    out.resize(binding_->n_vertices());
    for (size_t v = 0; v < out.size(); ++v) {
        Mat3 linear = Mat3::Zero();
        Vec3 offset = Vec3::Zero();
        for (const auto& [p, w] : binding_->influences(v)) {
            linear += w * particle[p].linear;
            offset += w * particle[p].offset;
        }
        out[v] = {linear, offset};
    }
}

}  // namespace sunder
