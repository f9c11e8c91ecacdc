#include "fracture_tools/skin/skinning.h"

#include <algorithm>
#include <atomic>

#include "solver/data/invariant.h"

namespace sunder {

size_t SkinBinding::chunk_of(size_t vertex) const {
    return std::upper_bound(first_vertex.begin(), first_vertex.end(), vertex) - first_vertex.begin() - 1;
}

std::span<const SkinInfluence> SkinBinding::influences(size_t vertex) const {
    const size_t c = chunk_of(vertex);
    return chunks[c]->influences(vertex - first_vertex[c]);
}

uint32_t SkinBinding::pool_vertex(size_t vertex) const {
    const size_t c = chunk_of(vertex);
    return chunks[c]->vertex[vertex - first_vertex[c]].pool_vertex;
}

std::vector<uint32_t> SkinBinding::pool_vertices() const {
    std::vector<uint32_t> all;
    all.reserve(n_vertices());
    for (const auto& chunk : chunks)
        for (const SkinChunk::Vertex& v : chunk->vertex) all.push_back(v.pool_vertex);
    return all;
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
    : rest_particle_(rest.rest_position), rings_(rest) {
    auto unbound = std::make_shared<SkinBinding>();
    unbound->rest_vertex = std::make_shared<const std::vector<Vec3>>(std::move(rest_vertex));
    binding_ = std::move(unbound);
    // Weighted by area: a neighbour behind a sliver of an interface says little about how far apart particles are.
    // The support is the one of the rest state also after edges broke, or weights would jump without need.
    place_.reserve(rest.n_particles() + 1);
    for (uint32_t i = 0; i < rest.n_particles(); ++i) {
        double area = 0, area_length = 0, length = 0;
        uint32_t count = 0;
        for (uint32_t s = rest.group_offset[i]; s < rest.group_offset[i + 1]; ++s) {
            if (rest.member_edge[s].is_none()) continue;
            const double l = (rest_particle_[rest.group_member[s]] - rest_particle_[i]).norm();
            const double a = rest.edges[rest.member_edge[s]].area;
            area += a, area_length += a * l, length += l, ++count;
        }
        const double mean = area > 0 ? area_length / area : count > 0 ? length / count : 0;
        const double support = mean > 0 ? kernel.reach * mean : 1.0;  // alone: whatever, it has no rival
        const Vec3& x = rest_particle_[i];
        place_.push_back({x.x(), x.y(), x.z(), 1 / (support * support)});
    }
    place_.push_back(ParticlePlace::nowhere());
}

struct Skin::Scratch {
    explicit Scratch(const IntactRings& rings) : lists(rings, kWeighed) {}

    CandidateLists lists;
    WeighScratch weighing;
    std::vector<uint32_t> stale, connected;
};

void Skin::bind(const SplitTopology& topology, std::span<const uint8_t> edge_intact, const RangeRunner& run) {
    rings_.update(edge_intact);
    const size_t n_chunks = topology.n_chunks();
    auto next = std::make_shared<SkinBinding>();
    next->rest_vertex = binding_->rest_vertex;
    next->chunks = binding_->chunks;
    next->chunks.resize(n_chunks), next->first_vertex.resize(n_chunks + 1);
    for (size_t c = 0; c <= n_chunks; ++c) next->first_vertex[c] = topology.chunk_vertex(c);
    std::atomic<size_t> turn{0};
    run(n_chunks, 1, [&](size_t, size_t) {  // whichever thread is free, with a memory of its own
        Scratch scratch(rings_);
        for (size_t chunk; (chunk = turn.fetch_add(1, std::memory_order_relaxed)) < n_chunks;) {
            find_stale(topology, chunk, scratch.stale);
            if (scratch.stale.empty() && !topology.any_changed(chunk) && next->chunks[chunk]) continue;
            next->chunks[chunk] = bind_chunk(topology, chunk, scratch);
        }
    });
    binding_ = std::move(next);
}

// Visual vertices of a chunk that change, counted from its first: with the fans that hang together in them, and with
// the ring of a fragment that is connected there.
void Skin::find_stale(const SplitTopology& topology, size_t chunk, std::vector<uint32_t>& out) const {
    const uint32_t first = topology.chunk_vertex(chunk), n = topology.chunk_vertex(chunk + 1) - first;
    const uint32_t* const key = topology.vertex_classes().data() + first;
    const uint32_t *const fragment = topology.fan_fragments().data(), *const joined = topology.fan_classes().data();
    const uint32_t* const pool_vertex_of = topology.fan_pool_vertices().data();
    const uint32_t* const first_fan = topology.first_fans().data();
    const uint8_t *const ring_changed = rings_.changed().data(), *const vertex_changed = topology.changed().data();
    const Vec3* const rest = binding_->rest_vertex->data();
    if (out.size() < n) out.resize(n);
    uint32_t* const stale = out.data();
    size_t found = 0;
    for (uint32_t v = 0; v < n; ++v) {
        const uint32_t lowest = key[v], pool_vertex = pool_vertex_of[lowest];
        uint8_t is_stale = vertex_changed[pool_vertex] | ring_changed[fragment[lowest]];
        for (uint32_t fan = lowest + 1, last = first_fan[pool_vertex + 1]; fan < last; ++fan)
            is_stale |= (joined[fan] == lowest) & ring_changed[fragment[fan]];
        if (is_stale) __builtin_prefetch(rest + pool_vertex);
        stale[found] = v, found += is_stale;
    }
    out.resize(found);
}

namespace {

// Exactly, as they are rounded to that.
bool sum_to_one(const SkinChunk& chunk) {
    for (size_t v = 0; v < chunk.n_vertices(); ++v) {
        double sum = 0;
        for (const SkinInfluence& i : chunk.influences(v)) sum += i.weight;
        if (sum != 1) return false;
    }
    return true;
}

}  // namespace

// What is left of the chunk as it was, and in between vertices that are bound anew.
std::shared_ptr<const SkinChunk> Skin::bind_chunk(const SplitTopology& topology, size_t chunk,
                                                  Scratch& io_scratch) const {
    const bool is_new = binding_->chunks.empty();
    const SkinChunk none, &old = is_new ? none : *binding_->chunks[chunk];
    const uint32_t first = topology.chunk_vertex(chunk), n = topology.chunk_vertex(chunk + 1) - first;
    const uint32_t* const key = topology.vertex_classes().data() + first;
    const auto made = std::make_shared<SkinChunk>();
    made->vertex.resize(n), made->nearest.resize(n);
    SkinChunk::Vertex* const vertex = made->vertex.data();
    uint32_t* const nearest = made->nearest.data();
    const SkinChunk::Vertex* const was_vertex = old.vertex.data();
    const uint32_t* const pool_vertex_of = topology.fan_pool_vertices().data();

    constexpr uint32_t kTypical = 8;  // influences of a vertex
    const uint32_t n_old = static_cast<uint32_t>(old.n_vertices());
    const uint32_t n_stale = static_cast<uint32_t>(io_scratch.stale.size());
    InfluencePool pool((n_old > 0 ? was_vertex[n_old - 1].end : 0) + kTypical * (n_stale + 4));

    // Around pool vertices that did not change there are the same vertices as before.
    uint32_t v = 0, was = 0;  // in this chunk, in the old one
    const auto keep_until = [&](uint32_t end) {
        while (v < end) {
            while (was_vertex[was].pool_vertex < pool_vertex_of[key[v]]) ++was;  // gone
            const uint32_t begin = was_vertex[was].begin, shift = pool.size() - begin;
            do {
                vertex[v] = was_vertex[was], vertex[v].begin += shift, vertex[v].end += shift;
                nearest[v++] = old.nearest[was++];
            } while (v < end && was_vertex[was].pool_vertex == pool_vertex_of[key[v]]);
            const SkinInfluence* const kept = old.influence.get();
            const uint32_t size = was_vertex[was - 1].end - begin;
            pool.add_copies(kept + begin, size);
        }
    };
    for (const uint32_t stale : io_scratch.stale) {
        keep_until(stale);
        const uint32_t pool_vertex = pool_vertex_of[key[v]], begin = pool.size();
        while (was < n_old && was_vertex[was].pool_vertex < pool_vertex) ++was;
        was += !topology.is_changed(pool_vertex);
        nearest[v] = bind_vertex(topology, key[v], io_scratch, pool);
        vertex[v++] = {pool_vertex, begin, pool.size()};
    }
    keep_until(n);
    made->influence = pool.memory();
    invariant("weights sum to one", [&] { return sum_to_one(*made); });
    return made;
}

// Adds the influences of the vertex that a fan is the lowest of; gives the particle that it follows first.
uint32_t Skin::bind_vertex(const SplitTopology& topology, uint32_t key, Scratch& io_scratch,
                           InfluencePool& io_pool) const {
    std::vector<uint32_t>& connected = io_scratch.connected;
    topology.fragments_of_class(key, connected);
    const Vec3& x = (*binding_->rest_vertex)[topology.fan_pool_vertex(key)];
    const std::span<const uint32_t> candidates = io_scratch.lists.find(connected);
    SkinInfluence* const out = io_pool.room(static_cast<uint32_t>(candidates.size()));
    io_pool.add(static_cast<uint32_t>(weigh(place_.data(), candidates, x, io_scratch.weighing, out)));
    if (connected.size() == 1) return connected[0];
    return *std::min_element(connected.begin(), connected.end(), [&](uint32_t i, uint32_t j) {
        return (rest_particle_[i] - x).squaredNorm() < (rest_particle_[j] - x).squaredNorm();
    });
}

}  // namespace sunder
