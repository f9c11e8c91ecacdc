#include "fracture_tools/skinning.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <limits>

#include "fracture_tools/vector_clones.h"

namespace sunder {
namespace {

typedef double Lanes __attribute__((vector_size(32), may_alias, aligned(8)));
typedef int64_t Order __attribute__((vector_size(32)));
typedef int32_t Parts __attribute__((vector_size(16), may_alias, aligned(4)));
typedef float Weights __attribute__((vector_size(16)));
typedef int64_t Pair __attribute__((vector_size(16)));
constexpr size_t kLanes = 4;

}  // namespace

size_t SkinBinding::chunk_of(size_t vertex) const {
    return std::upper_bound(first_vertex.begin(), first_vertex.end(), vertex) - first_vertex.begin() - 1;
}

std::span<const SkinBinding::Influence> SkinBinding::influences(size_t vertex) const {
    const size_t c = chunk_of(vertex);
    return chunks[c]->influences(vertex - first_vertex[c]);
}

uint32_t SkinBinding::pool_vertex(size_t vertex) const {
    const size_t c = chunk_of(vertex);
    return chunks[c]->vertex[vertex - first_vertex[c]].pool_vertex;
}

uint32_t SkinBinding::nearest(size_t vertex) const {
    const size_t c = chunk_of(vertex);
    return chunks[c]->vertex[vertex - first_vertex[c]].nearest;
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
    place_.reserve(rest.n_particles() + 1);
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
        const Vec3& x = rest_particle_[i];
        place_.push_back({x.x(), x.y(), x.z(), 1 / (support * support)});
    }
    constexpr double kNowhere = 1e200;  // its square is infinite
    place_.push_back({kNowhere, kNowhere, kNowhere, 1});
}

// Particles whose ring lost or won an edge.
void Skin::find_changed_rings(std::span<const uint8_t> edge_intact) {
    ring_changed_.assign(rest_particle_.size(), edge_intact_.empty());
    for (size_t e = 0; e < edge_intact_.size(); ++e)
        if (bool(edge_intact[e]) != bool(edge_intact_[e])) ring_changed_[edges_[e].a] = ring_changed_[edges_[e].b] = 1;
    edge_intact_.assign(edge_intact.begin(), edge_intact.end());
}

// A vertex changes with the fans that hang together in it, and with the ring of a fragment that is connected there.
bool Skin::find_changes(const SplitTopology& topology, size_t chunk) {
    const uint32_t begin = topology.chunk_fan(chunk), end = topology.chunk_fan(chunk + 1);
    const uint32_t *const fragment = topology.fan_fragments().data(), *const joined = topology.fan_classes().data();
    const uint8_t* const ring_changed = ring_changed_.data();
    uint8_t* const changed = class_changed_.data();
    std::fill(changed + begin, changed + end, 0);
    uint8_t any = 0;
    for (uint32_t fan = begin, v = static_cast<uint32_t>(chunk) * SplitTopology::kChunk; fan < end; ++v) {
        const uint8_t is_changed = topology.is_changed(v);
        for (const uint32_t last = topology.first_fan(v + 1); fan < last; ++fan) {
            const uint8_t fan_changed = is_changed | ring_changed[fragment[fan]];
            changed[joined[fan]] |= fan_changed, any |= fan_changed;
        }
    }
    return any != 0;
}

struct Skin::Scratch {
    explicit Scratch(size_t n_particles) : is_candidate(n_particles / 64 + 1, 0), lists(kLists) {}

    // Neighbours often have the same fragments connected: what was found for the last ones met, at the place that these
    // hash to.
    struct List {
        uint32_t begin = 0, n_connected = 0, n_candidates = 0;  // in `listed`
    };
    static constexpr size_t kLists = 256;

    std::vector<uint32_t> connected;
    std::vector<uint64_t> is_candidate;  // a bit a particle, all 0 between calls
    std::vector<List> lists;
    std::vector<uint32_t> listed;              // fragments connected, then candidates
    std::vector<double> number;                // of each candidate: squared distance in supports, weight
    std::vector<SkinChunk::Influence> weight;  // found for a chunk

    // Influences of a chunk that are put together: [begin, end) of the chunk as it was, or of `weight`.
    struct Part {
        bool is_old;
        uint32_t begin, end;
    };
    std::vector<Part> parts;
};

void Skin::bind(const SplitTopology& topology, std::span<const uint8_t> edge_intact, const RangeRunner& run) {
    const bool first = class_changed_.empty();
    find_changed_rings(edge_intact);
    class_changed_.resize(topology.n_fans());
    const size_t n_chunks = topology.n_chunks();
    auto next = std::make_shared<SkinBinding>();
    next->rest_vertex = binding_->rest_vertex;
    next->chunks = binding_->chunks;
    next->chunks.resize(n_chunks), next->first_vertex.resize(n_chunks + 1);
    for (size_t c = 0; c <= n_chunks; ++c) next->first_vertex[c] = topology.chunk_vertex(c);
    std::atomic<size_t> turn{0};
    run(n_chunks, 1, [&](size_t, size_t) {  // whichever thread is free, with a memory of its own
        Scratch scratch(rest_particle_.size());
        for (size_t chunk; (chunk = turn.fetch_add(1, std::memory_order_relaxed)) < n_chunks;)
            if (find_changes(topology, chunk) || first) bind_chunk(topology, chunk, scratch, *next);
    });
    binding_ = std::move(next);
    vertex_class_.assign(topology.vertex_classes().begin(), topology.vertex_classes().end());
}

void Skin::bind_chunk(const SplitTopology& topology, size_t chunk, Scratch& io_scratch, SkinBinding& io_next) const {
    const SkinChunk none, &old = io_next.chunks[chunk] ? *io_next.chunks[chunk] : none;
    const uint32_t n_old = static_cast<uint32_t>(old.n_vertices());
    const uint32_t* const old_key = vertex_class_.data() + (n_old > 0 ? binding_->first_vertex[chunk] : 0);
    const uint32_t first = io_next.first_vertex[chunk], n = io_next.first_vertex[chunk + 1] - first;
    const uint32_t* const key = topology.vertex_classes().data() + first;
    const auto made = std::make_shared<SkinChunk>();
    made->vertex.resize(n);
    SkinChunk::Vertex* const vertex = made->vertex.data();
    const SkinChunk::Vertex* const was = old.vertex.data();
    const uint8_t* const changed = class_changed_.data();

    std::vector<uint32_t>& connected = io_scratch.connected;
    std::vector<SkinChunk::Influence>& weight = io_scratch.weight;
    std::vector<Scratch::Part>& parts = io_scratch.parts;
    parts.clear();
    uint32_t found = 0, influence_end = 0;  // influences: in `weight`, in the chunk
    for (uint32_t v = 0, before = 0; v < n;) {
        while (before < n_old && old_key[before] < key[v]) ++before;
        const uint32_t begin = before > 0 ? was[before - 1].influence_end : 0, shift = influence_end - begin;
        uint32_t run = 0;  // of vertices that keep what they have
        for (const uint32_t most = std::min(n - v, n_old - before); run < most; ++run) {
            if (old_key[before + run] != key[v + run] || changed[key[v + run]]) break;
            const SkinChunk::Vertex& kept = was[before + run];
            vertex[v + run] = {kept.pool_vertex, kept.nearest, kept.influence_end + shift};
        }
        if (run > 0) {
            v += run, before += run;
            parts.push_back({true, begin, was[before - 1].influence_end});
            influence_end += parts.back().end - begin;
            continue;
        }
        topology.fragments_of_class(key[v], connected);
        const uint32_t pool_vertex = topology.pool_vertex(first + v);
        const Vec3& x = (*io_next.rest_vertex)[pool_vertex];
        const std::span<const uint32_t> candidates = find_candidates(io_scratch);
        if (found + candidates.size() > weight.size()) weight.resize(2 * (found + candidates.size()));
        const uint32_t more =
            static_cast<uint32_t>(weigh(place_.data(), candidates, x, io_scratch, weight.data() + found));
        if (parts.empty() || parts.back().is_old) parts.push_back({false, found, found});
        found += more, influence_end += more, parts.back().end = found;
        const uint32_t nearest = *std::min_element(connected.begin(), connected.end(), [&](uint32_t i, uint32_t j) {
            return (rest_particle_[i] - x).squaredNorm() < (rest_particle_[j] - x).squaredNorm();
        });
        vertex[v++] = {pool_vertex, nearest, influence_end};
    }
    made->influence.reserve(influence_end);
    for (const Scratch::Part& part : parts) {
        const auto from = part.is_old ? old.influence.begin() : weight.begin();
        made->influence.insert(made->influence.end(), from + part.begin, from + part.end);
    }
    io_next.chunks[chunk] = made;
}

// Of the fragments that are connected, ascending, so that sums over them are taken in the same order on every way to
// the same state; filled up to whole registers with the place where nobody is.
std::span<const uint32_t> Skin::find_candidates(Scratch& io_scratch) const {
    const std::vector<uint32_t>& connected = io_scratch.connected;
    uint32_t hash = 0;
    for (const uint32_t i : connected) hash = 31 * hash + i;
    std::vector<uint32_t>& listed = io_scratch.listed;
    Scratch::List& list = io_scratch.lists[hash % Scratch::kLists];
    const auto known = listed.begin() + list.begin;
    if (std::equal(connected.begin(), connected.end(), known, known + list.n_connected))
        return {&*known + list.n_connected, list.n_candidates};
    constexpr size_t kMost = 1 << 16;
    if (listed.size() > kMost)
        listed.clear(), std::fill(io_scratch.lists.begin(), io_scratch.lists.end(), Scratch::List{});
    list.begin = static_cast<uint32_t>(listed.size()), list.n_connected = static_cast<uint32_t>(connected.size());
    listed.insert(listed.end(), connected.begin(), connected.end());
    std::vector<uint64_t>& bits = io_scratch.is_candidate;
    uint32_t low = std::numeric_limits<uint32_t>::max(), high = 0;
    for (const uint32_t i : connected)
        for (uint32_t s = group_offset_[i]; s < group_offset_[i + 1]; ++s) {
            const uint32_t j = group_member_[s];
            if (member_edge_[s] != SimulationMesh::kNone && !edge_intact_[member_edge_[s]]) continue;
            bits[j / 64] |= uint64_t{1} << j % 64;
            low = std::min(low, j), high = std::max(high, j);
        }
    for (uint32_t word = low / 64; word <= high / 64; ++word)
        for (; bits[word] != 0; bits[word] &= bits[word] - 1)
            listed.push_back(64 * word + static_cast<uint32_t>(std::countr_zero(bits[word])));
    const size_t first = list.begin + connected.size();
    while ((listed.size() - first) % kLanes != 0) listed.push_back(static_cast<uint32_t>(place_.size() - 1));
    list.n_candidates = static_cast<uint32_t>(listed.size() - first);
    return {listed.data() + first, list.n_candidates};
}

// Writes the influences of a vertex at x, and gives their number; `out` has room for all of `particle`.
SUNDER_VECTOR_CLONES size_t Skin::weigh(const Place* place, std::span<const uint32_t> particle, const Vec3& x,
                                        Scratch& io_scratch, SkinChunk::Influence* out) {
    const size_t n = particle.size();
    if (io_scratch.number.size() < n) io_scratch.number.resize(2 * n);
    double* const number = io_scratch.number.data();
    const auto numbers = [&](size_t i) -> Lanes& { return reinterpret_cast<Lanes&>(number[i]); };
    const auto at = [&](size_t i) -> const Lanes& { return reinterpret_cast<const Lanes&>(place[particle[i]]); };
    const Lanes x0 = Lanes{} + x.x(), x1 = Lanes{} + x.y(), x2 = Lanes{} + x.z();

    Lanes closest = Lanes{} + std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < n; i += kLanes) {
        const Lanes a = at(i), b = at(i + 1), c = at(i + 2), d = at(i + 3);
        const Lanes ab_xz = __builtin_shuffle(a, b, Order{0, 4, 2, 6}),
                    ab_yr = __builtin_shuffle(a, b, Order{1, 5, 3, 7});
        const Lanes cd_xz = __builtin_shuffle(c, d, Order{0, 4, 2, 6}),
                    cd_yr = __builtin_shuffle(c, d, Order{1, 5, 3, 7});
        const Lanes dx = __builtin_shuffle(ab_xz, cd_xz, Order{0, 1, 4, 5}) - x0;
        const Lanes dy = __builtin_shuffle(ab_yr, cd_yr, Order{0, 1, 4, 5}) - x1;
        const Lanes dz = __builtin_shuffle(ab_xz, cd_xz, Order{2, 3, 6, 7}) - x2;
        const Lanes t = (dx * dx + dy * dy + dz * dz) * __builtin_shuffle(ab_yr, cd_yr, Order{2, 3, 6, 7});
        numbers(i) = t;
        closest = t < closest ? t : closest;
    }
    // Far out (a spike, a long thin piece) the supports grow with the distance, so that the nearest always has a say.
    constexpr double kFarOut = 0.75 * 0.75;
    const double least = std::min(std::min(closest[0], closest[1]), std::min(closest[2], closest[3]));
    const double shrink = 1 / std::max(1.0, least / kFarOut);
    Lanes sums = {};
    for (size_t i = 0; i < n; i += kLanes) {
        const Lanes left = 1 - numbers(i) * shrink, k = left > 0 ? left : Lanes{};
        numbers(i) = k * k * k;
        sums += numbers(i);
    }
    constexpr double kOne = 16777216;  // 2^24 parts
    constexpr float kPart = static_cast<float>(1 / kOne);
    const double scale = kOne / ((sums[0] + sums[1]) + (sums[2] + sums[3]));
    Parts left = {};
    int64_t kept = 0, largest = 0;
    int32_t most = 0;
    for (size_t i = 0; i < n; i += kLanes) {  // without branches, which nothing would foretell
        const Parts parts = __builtin_convertvector(numbers(i) * scale + 0.5, Parts), some = parts != 0;
        const Parts weight = reinterpret_cast<Parts>(__builtin_convertvector(parts, Weights) * kPart);
        const Parts which = reinterpret_cast<const Parts&>(particle[i]);
        const Pair pair[2] = {reinterpret_cast<Pair>(__builtin_shuffle(which, weight, Parts{0, 4, 1, 5})),
                              reinterpret_cast<Pair>(__builtin_shuffle(which, weight, Parts{2, 6, 3, 7}))};
        left -= parts;
        for (size_t k = 0; k < kLanes; ++k) {
            const int64_t influence = pair[k / 2][k % 2];
            std::memcpy(out + kept, &influence, sizeof influence);
            largest = parts[k] > most ? kept : largest, most = parts[k] > most ? parts[k] : most;
            kept -= some[k];
        }
    }
    const int32_t rest = static_cast<int32_t>(kOne) + ((left[0] + left[1]) + (left[2] + left[3]));
    out[largest].weight += static_cast<float>(rest) * kPart;
    return static_cast<size_t>(kept);
}

}  // namespace sunder
