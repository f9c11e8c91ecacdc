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
      ring_changed_(rest.n_particles(), 1) {
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

void Skin::bind(const SplitTopology& topology, std::span<const uint8_t> edge_intact, const RangeRunner& run) {
    mark_changed_rings(edge_intact);
    constexpr size_t kChunk = 1024;  // vertices
    const size_t n = topology.n_vertices(), n_chunks = (n + kChunk - 1) / kChunk;
    const std::shared_ptr<SkinBinding> next = recycler_.take().object;
    next->rest_vertex = binding_->rest_vertex;
    next->pool_vertex.resize(n), next->nearest.resize(n), next->influence_offset.resize(n + 1);
    chunk_.resize(n_chunks);
    run(n_chunks, 1, [&](size_t begin, size_t end) {
        Scratch scratch;
        scratch.is_candidate.assign(rest_particle_.size(), 0);
        for (size_t c = begin; c < end; ++c) {
            chunk_[c].clear();
            for (size_t v = c * kChunk; v < std::min(n, (c + 1) * kChunk); ++v)
                bind_vertex(topology, static_cast<uint32_t>(v), scratch, *next, chunk_[c]);
        }
    });
    next->influence_offset[0] = 0;
    for (size_t v = 0; v < n; ++v) next->influence_offset[v + 1] += next->influence_offset[v];
    const size_t n_influences = next->influence_offset[n];
    if (next->influence.capacity() < n_influences) {
        next->influence = {};
        next->influence.reserve(n_influences + n_influences / 8);
    }
    next->influence.resize(n_influences);
    run(n_chunks, 1, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c)
            std::copy(chunk_[c].begin(), chunk_[c].end(), next->influence.begin() + next->influence_offset[c * kChunk]);
    });
    binding_ = next;
}

// Writes everything of the vertex but the place of its influences: how many there are stands at vertex + 1 for now.
void Skin::bind_vertex(const SplitTopology& topology, uint32_t v, Scratch& scratch, SkinBinding& io_next,
                       std::vector<SkinBinding::Influence>& out) const {
    const SkinBinding& old = *binding_;
    io_next.pool_vertex[v] = topology.pool_vertex(v);
    std::vector<uint32_t>& connected = scratch.connected;
    topology.connected_fragments(v, connected);
    const uint32_t before = topology.previous_vertex(v);
    const bool changed = before == SplitTopology::kNone || before >= old.n_vertices() ||
                         std::any_of(connected.begin(), connected.end(), [&](uint32_t i) { return ring_changed_[i]; });
    const size_t n_before = out.size();
    if (!changed) {
        io_next.nearest[v] = old.nearest[before];
        const auto kept = old.influences(before);
        out.insert(out.end(), kept.begin(), kept.end());
    } else {
        const Vec3& x = io_next.rest_position(v);
        io_next.nearest[v] = *std::min_element(connected.begin(), connected.end(), [&](uint32_t i, uint32_t j) {
            return (rest_particle_[i] - x).squaredNorm() < (rest_particle_[j] - x).squaredNorm();
        });
        find_candidates(scratch);
        weigh(x, scratch);
        out.insert(out.end(), scratch.weights.begin(), scratch.weights.end());
    }
    io_next.influence_offset[v + 1] = static_cast<uint32_t>(out.size() - n_before);
}

// Ascending, so that sums over them are taken in the same order on every way to the same state.
void Skin::find_candidates(Scratch& io_scratch) const {
    auto& [connected, candidate, is_candidate, weights] = io_scratch;
    candidate.clear();
    for (uint32_t i : connected)
        for (uint32_t s = group_offset_[i]; s < group_offset_[i + 1]; ++s) {
            const uint32_t j = group_member_[s];
            if (is_candidate[j] || (member_edge_[s] != SimulationMesh::kNone && !edge_intact_[member_edge_[s]]))
                continue;
            is_candidate[j] = 1;
            candidate.push_back(j);
        }
    std::sort(candidate.begin(), candidate.end());
    for (uint32_t j : candidate) is_candidate[j] = 0;
}

void Skin::weigh(const Vec3& x, Scratch& io_scratch) const {
    std::vector<SkinBinding::Influence>& out = io_scratch.weights;
    out.clear();
    double closest = std::numeric_limits<double>::infinity();  // in supports
    for (uint32_t j : io_scratch.candidate) {
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

}  // namespace sunder
