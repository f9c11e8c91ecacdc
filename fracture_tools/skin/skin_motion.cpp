#include "fracture_tools/skin/skin_motion.h"

#include <algorithm>
#include <atomic>

#include "fracture_tools/skin/vector_clones.h"

namespace sunder {
namespace {

bool equal(const Affine& a, const Affine& b) { return a.linear == b.linear && a.offset == b.offset; }

typedef double Doubles __attribute__((vector_size(32), may_alias));
typedef float FloatLanes __attribute__((vector_size(16), may_alias));

struct Blend {
    Doubles column[4];
};

inline __attribute__((always_inline)) void blend(std::span<const SkinInfluence> influences, const AffineColumns* map,
                                                 Blend& out) {
    Doubles c0{}, c1{}, c2{}, c3{};
    for (const auto& [p, w] : influences) {
        const Doubles* m = reinterpret_cast<const Doubles*>(map[p].column);
        const double one = w;
        const Doubles weight = {one, one, one, one};
        c0 += weight * m[0], c1 += weight * m[1], c2 += weight * m[2], c3 += weight * m[3];
    }
    out.column[0] = c0, out.column[1] = c1, out.column[2] = c2, out.column[3] = c3;
}

inline __attribute__((always_inline)) Vec3 apply(const Blend& b, const Vec3& x) {
    const Doubles y = b.column[0] * x.x() + b.column[1] * x.y() + b.column[2] * x.z() + b.column[3];
    return {y[0], y[1], y[2]};
}

// Columns of the cofactor matrix are cross products of the columns.
inline __attribute__((always_inline)) void cofactor_of(const Blend& b, NormalMap& out) {
    for (int k = 0; k < 3; ++k) {
        const Doubles &u = b.column[(k + 1) % 3], &v = b.column[(k + 2) % 3];
        const Doubles cross = __builtin_shufflevector(u, u, 1, 2, 0, 3) * __builtin_shufflevector(v, v, 2, 0, 1, 3) -
                              __builtin_shufflevector(u, u, 2, 0, 1, 3) * __builtin_shufflevector(v, v, 1, 2, 0, 3);
        *reinterpret_cast<FloatLanes*>(out.column[k]) = __builtin_convertvector(cross, FloatLanes);
    }
}

// `moved`, `out` and `out_normal_map` are of the chunk's first vertex.
SUNDER_VECTOR_CLONES void place(const SkinChunk& chunk, const Vec3* rest, const AffineColumns* map,
                                const uint8_t* moved, Vec3* out, NormalMap* out_normal_map) {
    const SkinChunk::Vertex* const vertex = chunk.vertex.data();
    const SkinInfluence* const influence = chunk.influence.get();
    const size_t n = chunk.n_vertices();
    Blend b;
    for (size_t v = 0; v < n; ++v) {
        if (!moved[v]) continue;
        blend({influence + vertex[v].begin, vertex[v].end - vertex[v].begin}, map, b);
        out[v] = apply(b, rest[vertex[v].pool_vertex]);
        if (out_normal_map) cofactor_of(b, out_normal_map[v]);
    }
}

}  // namespace

AffineColumns AffineColumns::of(const Affine& a) {
    AffineColumns out{};
    for (int i = 0; i < 3; ++i) {
        for (int c = 0; c < 3; ++c) out.column[c][i] = a.linear(i, c);
        out.column[3][i] = a.offset(i);
    }
    return out;
}

bool SkinMotion::take(bool is_rebound, std::span<const Affine> particle, std::span<const Affine> rate) {
    const size_t n_particles = particle.size();
    const bool is_new = is_rebound || particle_.size() != n_particles || rate_.size() != rate.size();
    particle_moved_.assign(n_particles, 1);
    if (!is_new)
        for (size_t p = 0; p < n_particles; ++p)
            particle_moved_[p] = !equal(particle[p], particle_[p]) || (!rate.empty() && !equal(rate[p], rate_[p]));
    const size_t n_moved = static_cast<size_t>(std::count(particle_moved_.begin(), particle_moved_.end(), 1));
    if (n_moved == 0 && !is_new) return false;
    all_moved_ = 2 * n_moved >= n_particles;  // to look which vertices rest costs as much as to move them
    if (all_moved_) std::fill(particle_moved_.begin(), particle_moved_.end(), 1);

    ++frame_;
    particle_.assign(particle.begin(), particle.end()), rate_.assign(rate.begin(), rate.end());
    map_.resize(n_particles), map_rate_.resize(rate.size());
    for (size_t p = 0; p < n_particles; ++p)
        if (particle_moved_[p]) {
            map_[p] = AffineColumns::of(particle[p]);
            if (!rate.empty()) map_rate_[p] = AffineColumns::of(rate[p]);
        }
    return true;
}

void SkinMotion::move(const SkinBinding& binding, const RangeRunner& run, const Placed& placed) {
    const size_t n = binding.n_vertices(), n_chunks = binding.chunks.size();
    position_.reserve(most_vertices_), moved_.reserve(most_vertices_);
    position_.resize(n), moved_.resize(n), chunk_changed_.resize(n_chunks);
    if (!rate_.empty()) velocity_.reserve(most_vertices_);
    velocity_.resize(rate_.empty() ? 0 : n);
    std::atomic<size_t> turn{0};
    run(n_chunks, 2, [&](size_t, size_t) {  // whichever thread is free, with a memory of its own
        std::vector<NormalMap> normal_map;
        for (size_t chunk; (chunk = turn.fetch_add(1, std::memory_order_relaxed)) < n_chunks;) {
            const size_t n_maps = extras_ == SkinExtras::normal_maps ? binding.chunks[chunk]->n_vertices() : 0;
            if (normal_map.size() < n_maps) normal_map.resize(n_maps);
            move_chunk(binding, chunk, n_maps > 0 ? normal_map.data() : nullptr);
            if (placed) placed(chunk, {normal_map.data(), n_maps});
        }
    });
}

void SkinMotion::move_chunk(const SkinBinding& binding, size_t chunk, NormalMap* out_normal_map) {
    const SkinChunk& of = *binding.chunks[chunk];
    const size_t first = binding.first_vertex[chunk], n = of.n_vertices();
    uint8_t* moved = moved_.data() + first;
    if (all_moved_) {
        std::fill(moved, moved + n, 1);
    } else {
        bool any = false;
        for (size_t v = 0; v < n; ++v) {
            const auto influences = of.influences(v);
            moved[v] = std::any_of(influences.begin(), influences.end(),
                                   [&](const auto& i) { return particle_moved_[i.particle]; });
            any |= moved[v];
        }
        if (!any) return;
    }
    chunk_changed_[chunk] = frame_;
    const Vec3* rest = binding.rest_vertex->data();
    place(of, rest, map_.data(), moved, position_.data() + first, out_normal_map);
    if (!velocity_.empty()) place(of, rest, map_rate_.data(), moved, velocity_.data() + first, nullptr);
}

Mat3 SkinMotion::linear_at(const SkinBinding& binding, size_t vertex) const {
    Mat3 linear = Mat3::Zero();
    for (const auto& [p, w] : binding.influences(vertex)) linear += double{w} * particle_[p].linear;
    return linear;
}

}  // namespace sunder
