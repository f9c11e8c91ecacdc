#include "fracture_tools/skinning.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace sunder {

void SkinChunk::add(uint32_t vertex_key, uint32_t pool, uint32_t nearest_particle,
                    std::span<const Influence> influences) {
    key.push_back(vertex_key), pool_vertex.push_back(pool), nearest.push_back(nearest_particle);
    influence.insert(influence.end(), influences.begin(), influences.end());
    influence_offset.push_back(static_cast<uint32_t>(influence.size()));
}

size_t SkinBinding::chunk_of(size_t vertex) const {
    return std::upper_bound(first_vertex.begin(), first_vertex.end(), vertex) - first_vertex.begin() - 1;
}

std::span<const SkinBinding::Influence> SkinBinding::influences(size_t vertex) const {
    const size_t c = chunk_of(vertex);
    return chunks[c]->influences(vertex - first_vertex[c]);
}

uint32_t SkinBinding::pool_vertex(size_t vertex) const {
    const size_t c = chunk_of(vertex);
    return chunks[c]->pool_vertex[vertex - first_vertex[c]];
}

uint32_t SkinBinding::nearest(size_t vertex) const {
    const size_t c = chunk_of(vertex);
    return chunks[c]->nearest[vertex - first_vertex[c]];
}

std::vector<uint32_t> SkinBinding::influence_offset() const {
    std::vector<uint32_t> offset = {0};
    offset.reserve(n_vertices() + 1);
    for (const auto& chunk : chunks)
        for (size_t v = 0; v < chunk->n_vertices(); ++v)
            offset.push_back(offset.back() + static_cast<uint32_t>(chunk->influences(v).size()));
    return offset;
}

Skin::Skin(std::vector<Vec3> rest_vertex, const SimulationMesh& rest, const SkinKernel& kernel)
    : rest_particle_(rest.rest_position),
      edges_(rest.edges),
      group_offset_(rest.group_offset),
      group_member_(rest.group_member),
      member_edge_(rest.member_edge),
      kernel_(kernel) {
    auto unbound = std::make_shared<SkinBinding>();
    unbound->rest_vertex = std::make_shared<const std::vector<Vec3>>(std::move(rest_vertex));
    binding_ = std::move(unbound);
    // Weighted by area: a neighbour behind a sliver of an interface says little about how far apart particles are.
    // The support is the one of the rest state also after edges broke, or weights would jump without need.
    inv_square_support_.resize(rest.n_particles());
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
        const double support = mean > 0 ? kernel_.reach * mean : 1.0;  // alone: whatever, it has no rival
        inv_square_support_[i] = 1 / (support * support);
    }
}

void Skin::list_fans_of_fragments(const SplitTopology& topology) {
    const size_t n_fans = topology.n_fans();
    fragment_fan_offset_.assign(rest_particle_.size() + 1, 0), fragment_fan_.resize(n_fans);
    for (uint32_t fan = 0; fan < n_fans; ++fan) ++fragment_fan_offset_[topology.fan_fragment(fan) + 1];
    std::partial_sum(fragment_fan_offset_.begin(), fragment_fan_offset_.end(), fragment_fan_offset_.begin());
    std::vector<uint32_t> next(fragment_fan_offset_.begin(), fragment_fan_offset_.end() - 1);
    for (uint32_t fan = 0; fan < n_fans; ++fan) fragment_fan_[next[topology.fan_fragment(fan)]++] = fan;
}

// A vertex changes with the fans that hang together in it, and with the ring of a fragment that is connected there.
void Skin::find_changes(const SplitTopology& topology, std::span<const uint8_t> edge_intact) {
    const bool first = class_changed_.empty();
    class_changed_.assign(topology.n_fans(), first), chunk_changed_.assign(topology.n_chunks(), first);
    const auto mark = [&](uint32_t fan) { class_changed_[fan] = chunk_changed_[fan / SplitTopology::kFanChunk] = 1; };
    if (first) {
        list_fans_of_fragments(topology);
    } else {
        for (const uint32_t v : topology.changed_vertices())
            for (uint32_t fan = topology.first_fan(v); fan < topology.first_fan(v + 1); ++fan) mark(fan);
        std::vector<uint8_t> ring_changed(rest_particle_.size(), 0);
        for (size_t e = 0; e < edge_intact_.size(); ++e)
            if (bool(edge_intact[e]) != bool(edge_intact_[e]))
                ring_changed[edges_[e].a] = ring_changed[edges_[e].b] = 1;
        for (size_t p = 0; p < ring_changed.size(); ++p)
            for (uint32_t i = fragment_fan_offset_[p]; ring_changed[p] && i < fragment_fan_offset_[p + 1]; ++i)
                mark(topology.fan_class(fragment_fan_[i]));
    }
    edge_intact_.assign(edge_intact.begin(), edge_intact.end());
}

void Skin::bind(const SplitTopology& topology, std::span<const uint8_t> edge_intact, const RangeRunner& run) {
    find_changes(topology, edge_intact);
    const size_t n_chunks = topology.n_chunks();
    auto next = std::make_shared<SkinBinding>();
    next->rest_vertex = binding_->rest_vertex;
    next->chunks = binding_->chunks;
    next->chunks.resize(n_chunks), next->first_vertex.resize(n_chunks + 1);
    for (size_t c = 0; c <= n_chunks; ++c) next->first_vertex[c] = topology.chunk_vertex(c);
    std::vector<uint32_t> changed;
    for (uint32_t c = 0; c < n_chunks; ++c)
        if (chunk_changed_[c]) changed.push_back(c);
    run(changed.size(), 1, [&](size_t begin, size_t end) {
        Scratch scratch;
        scratch.is_candidate.assign(rest_particle_.size(), 0);
        for (size_t i = begin; i < end; ++i) bind_chunk(topology, changed[i], scratch, *next);
    });
    binding_ = std::move(next);
}

void Skin::bind_chunk(const SplitTopology& topology, size_t chunk, Scratch& io_scratch, SkinBinding& io_next) const {
    const SkinChunk none, &old = io_next.chunks[chunk] ? *io_next.chunks[chunk] : none;
    const auto made = std::make_shared<SkinChunk>();
    SkinChunk& out = *made;
    const size_t n = io_next.first_vertex[chunk + 1] - io_next.first_vertex[chunk];
    out.key.reserve(n), out.pool_vertex.reserve(n), out.nearest.reserve(n), out.influence_offset.reserve(n + 1);
    out.influence.reserve(old.influence.size() + 8 * (n > old.key.size() ? n - old.key.size() : 0));
    std::vector<uint32_t>& connected = io_scratch.connected;
    size_t before = 0;
    for (uint32_t v = io_next.first_vertex[chunk]; v < io_next.first_vertex[chunk + 1]; ++v) {
        const uint32_t key = topology.vertex_class(v), pool = topology.pool_vertex(v);
        while (before < old.key.size() && old.key[before] < key) ++before;
        if (!class_changed_[key] && before < old.key.size() && old.key[before] == key) {
            out.add(key, pool, old.nearest[before], old.influences(before));
            continue;
        }
        topology.fragments_of_class(key, connected);
        const Vec3& x = (*io_next.rest_vertex)[pool];
        find_candidates(io_scratch);
        weigh(x, io_scratch);
        const uint32_t nearest = *std::min_element(connected.begin(), connected.end(), [&](uint32_t i, uint32_t j) {
            return (rest_particle_[i] - x).squaredNorm() < (rest_particle_[j] - x).squaredNorm();
        });
        out.add(key, pool, nearest, io_scratch.weights);
    }
    io_next.chunks[chunk] = made;
}

// Ascending, so that sums over them are taken in the same order on every way to the same state.
void Skin::find_candidates(Scratch& io_scratch) const {
    auto& [connected, connected_before, candidate, is_candidate, weights] = io_scratch;
    if (connected == connected_before) return;  // neighbours often have the same
    connected_before = connected;
    candidate.clear();
    for (uint32_t i : connected)
        for (uint32_t s = group_offset_[i]; s < group_offset_[i + 1]; ++s) {
            const uint32_t j = group_member_[s];
            if (is_candidate[j] || (member_edge_[s] != SimulationMesh::kNone && !edge_intact_[member_edge_[s]]))
                continue;
            is_candidate[j] = 1;
            candidate.push_back(j);
        }
    if (connected.size() > 1) std::sort(candidate.begin(), candidate.end());  // one ring is
    for (uint32_t j : candidate) is_candidate[j] = 0;
}

void Skin::weigh(const Vec3& x, Scratch& io_scratch) const {
    std::vector<SkinBinding::Influence>& out = io_scratch.weights;
    out.resize(io_scratch.candidate.size());
    double closest = std::numeric_limits<double>::infinity();  // squares, in supports
    for (size_t i = 0; i < out.size(); ++i) {
        const uint32_t j = io_scratch.candidate[i];
        const double t = (rest_particle_[j] - x).squaredNorm() * inv_square_support_[j];
        closest = std::min(closest, t);
        out[i] = {j, t};
    }
    // Far out (a spike, a long thin piece) the supports grow with the distance, so that the nearest always has a say.
    constexpr double kFarOut = 0.75 * 0.75;
    const double grow = std::max(1.0, closest / kFarOut);
    double sum = 0;
    size_t n = 0;
    for (const auto& [j, t] : out) {
        if (!(t < grow)) continue;
        const double k = 1 - t / grow;
        out[n++] = {j, k * k * k};
        sum += out[n - 1].weight;
    }
    out.resize(n);
    for (SkinBinding::Influence& i : out) i.weight /= sum;
}

}  // namespace sunder
