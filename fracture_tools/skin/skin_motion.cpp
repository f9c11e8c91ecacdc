#include "fracture_tools/skin/skin_motion.h"

#include <algorithm>
#include <atomic>

#include "fracture_tools/skin/vector_clones.h"

namespace sunder {
namespace {

bool equal(const Affine& a, const Affine& b) { return a.linear == b.linear && a.offset == b.offset; }

// Of maps or of rates.
template <class Maps>
bool equal(const Maps& a, const Maps& b, size_t p) {
    return equal(a.carried[p], b.carried[p]) &&
           (a.turned.empty() || (equal(a.turned[p], b.turned[p]) && a.turn[p].coeffs() == b.turn[p].coeffs()));
}

template <class Maps>
void list_columns(const Maps& maps, std::span<const uint8_t> wanted, ParticleColumns& out) {
    out.carried.resize(maps.carried.size());
    out.turning.resize(maps.turned.size()), out.turns.resize(maps.turned.size());
    for (size_t p = 0; p < maps.carried.size(); ++p) {
        if (!wanted[p]) continue;
        out.carried[p] = AffineColumns::of(maps.carried[p]);
        if (maps.turned.empty()) continue;
        out.turning[p].turned = AffineColumns::of(maps.turned[p]);
        out.turns[p] = !maps.turned[p].linear.isZero(0);
        for (int k = 0; k < 4; ++k) out.turning[p].turn[k] = maps.turn[p].coeffs()[k];
    }
}

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

inline __attribute__((always_inline)) Doubles cross(const Doubles& u, const Doubles& v) {
    return __builtin_shufflevector(u, u, 1, 2, 0, 3) * __builtin_shufflevector(v, v, 2, 0, 1, 3) -
           __builtin_shufflevector(u, u, 2, 0, 1, 3) * __builtin_shufflevector(v, v, 1, 2, 0, 3);
}

inline __attribute__((always_inline)) bool any_of(std::span<const SkinInfluence> influences, const uint8_t* flag) {
    uint8_t any = 0;
    for (const SkinInfluence& i : influences) any |= flag[i.particle];
    return any != 0;
}

struct TurningBlend {
    Blend turned;
    Doubles turn{};  // x, y, z, w of a quaternion of any length
};

inline __attribute__((always_inline)) void add_turning(const TurningColumns& c, double weight, double signed_weight,
                                                       TurningBlend& io_sum) {
    const Doubles* const m = reinterpret_cast<const Doubles*>(c.turned.column);
    const Doubles w = {weight, weight, weight, weight};
    const Doubles with_sign = {signed_weight, signed_weight, signed_weight, signed_weight};
    for (int k = 0; k < 4; ++k) io_sum.turned.column[k] += w * m[k];
    io_sum.turn += with_sign * *reinterpret_cast<const Doubles*>(c.turn);
}

// Of maps and, where there are any, of rates; each quaternion with the sign that is nearer to the heaviest one's.
inline __attribute__((always_inline)) void blend_turning(std::span<const SkinInfluence> influences,
                                                         const TurningColumns* map, const TurningColumns* rate,
                                                         TurningBlend& out, TurningBlend& out_rate) {
    const SkinInfluence* heaviest = influences.data();
    for (const SkinInfluence& i : influences)
        if (i.weight > heaviest->weight) heaviest = &i;
    const double* const near = map[heaviest->particle].turn;
    TurningBlend sum{}, rate_sum{};
    for (const auto& [p, w] : influences) {
        const double* const q = map[p].turn;
        const double one = w, dot = q[0] * near[0] + q[1] * near[1] + q[2] * near[2] + q[3] * near[3];
        const double with_sign = dot < 0 ? -one : one;
        add_turning(map[p], one, with_sign, sum);
        if (rate) add_turning(rate[p], one, with_sign, rate_sum);
    }
    out = sum, out_rate = rate_sum;
}

// The rotation of a quaternion of any length but zero, which no sum of such signs has.
struct Turn {
    Doubles column[3];

    inline __attribute__((always_inline)) explicit Turn(const Doubles& q) {
        const double x = q[0], y = q[1], z = q[2], w = q[3], s = 2 / (x * x + y * y + z * z + w * w);
        column[0] = Doubles{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y), 0};
        column[1] = Doubles{s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x), 0};
        column[2] = Doubles{s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y), 0};
    }
    inline __attribute__((always_inline)) Doubles apply(const Doubles& v) const {
        return column[0] * v[0] + column[1] * v[1] + column[2] * v[2];
    }
};

// How fast the rotation of q turns, rad/s: twice the vector part of rate conj(q), over |q|^2.
inline __attribute__((always_inline)) Doubles spin_of(const Doubles& q, const Doubles& rate) {
    const double s = 2 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const Doubles scale = {s, s, s, 0};
    return (q[3] * rate - rate[3] * q + cross(q, rate)) * scale;
}

// Columns of the cofactor matrix are cross products of the columns.
inline __attribute__((always_inline)) void cofactor_of(const Blend& b, NormalMap& out) {
    for (int k = 0; k < 3; ++k) {
        const Doubles &u = b.column[(k + 1) % 3], &v = b.column[(k + 2) % 3];
        *reinterpret_cast<FloatLanes*>(out.column[k]) = __builtin_convertvector(cross(u, v), FloatLanes);
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

// The same with what turns as the vertex does, and d/dt of it where there are rates: (Q y)' = w x Q y + Q y'.
SUNDER_VECTOR_CLONES void place_turning(const SkinChunk& chunk, const Vec3* rest, const ParticleColumns& map,
                                        const ParticleColumns* rate, const uint8_t* moved, Vec3* out, Vec3* out_rate,
                                        NormalMap* out_normal_map) {
    const AffineColumns* const carried = map.carried.data();
    const AffineColumns* const carried_rate = rate ? rate->carried.data() : nullptr;
    const TurningColumns* const turning = map.turning.data();
    const TurningColumns* const turning_rate = rate ? rate->turning.data() : nullptr;
    const uint8_t* const turns = map.turns.data();
    const size_t n = chunk.n_vertices();
    Blend b, b_rate;
    for (size_t v = 0; v < n; ++v) {
        if (!moved[v]) continue;
        const auto influences = chunk.influences(v);
        const Vec3& x = rest[chunk.vertex[v].pool_vertex];
        blend(influences, carried, b);
        if (rate) blend(influences, carried_rate, b_rate);
        if (any_of(influences, turns)) {
            TurningBlend t, t_rate;
            blend_turning(influences, turning, turning_rate, t, t_rate);
            const Turn turn(t.turn);
            for (int k = 0; k < 4; ++k) t.turned.column[k] = turn.apply(t.turned.column[k]);
            for (int k = 0; k < 4; ++k) b.column[k] += t.turned.column[k];
            if (rate) {
                const Doubles spin = spin_of(t.turn, t_rate.turn);
                for (int k = 0; k < 4; ++k)
                    b_rate.column[k] += cross(spin, t.turned.column[k]) + turn.apply(t_rate.turned.column[k]);
            }
        }
        out[v] = apply(b, x);
        if (rate) out_rate[v] = apply(b_rate, x);
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

bool SkinMotion::take(bool is_rebound, const ParticleMaps& particle, const ParticleMapRates& rate) {
    const size_t n_particles = particle.carried.size();
    const bool is_new =
        is_rebound || particle_.carried.size() != n_particles || rate_.carried.size() != rate.carried.size();
    particle_moved_.assign(n_particles, 1);
    if (!is_new)
        for (size_t p = 0; p < n_particles; ++p)
            particle_moved_[p] = !equal(particle, particle_, p) || (!rate.carried.empty() && !equal(rate, rate_, p));
    const size_t n_moved = static_cast<size_t>(std::count(particle_moved_.begin(), particle_moved_.end(), 1));
    if (n_moved == 0 && !is_new) return false;
    all_moved_ = 2 * n_moved >= n_particles;  // to look which vertices rest costs as much as to move them
    if (all_moved_) std::fill(particle_moved_.begin(), particle_moved_.end(), 1);

    ++frame_;
    particle_ = particle, rate_ = rate;
    list_columns(particle, particle_moved_, map_);
    if (!rate.carried.empty()) list_columns(rate, particle_moved_, map_rate_);
    return true;
}

void SkinMotion::move(const SkinBinding& binding, const RangeRunner& run, const Placed& placed,
                      const Corrected& correct) {
    const size_t n = binding.n_vertices(), n_chunks = binding.chunks.size();
    position_.reserve(most_vertices_), moved_.reserve(most_vertices_);
    position_.resize(n), moved_.resize(n), chunk_changed_.resize(n_chunks);
    if (!rate_.carried.empty()) velocity_.reserve(most_vertices_);
    velocity_.resize(rate_.carried.empty() ? 0 : n);
    std::atomic<size_t> turn{0};
    run(n_chunks, 2, [&](size_t, size_t) {  // whichever thread is free, with a memory of its own
        std::vector<NormalMap> normal_map;
        for (size_t chunk; (chunk = turn.fetch_add(1, std::memory_order_relaxed)) < n_chunks;) {
            const size_t n_maps = extras_ == SkinExtras::normal_maps ? binding.chunks[chunk]->n_vertices() : 0;
            if (normal_map.size() < n_maps) normal_map.resize(n_maps);
            move_chunk(binding, chunk, n_maps > 0 ? normal_map.data() : nullptr);
            if (correct) {
                const size_t first = binding.first_vertex[chunk], n_own = binding.chunks[chunk]->n_vertices();
                const size_t n_moving = velocity_.empty() ? 0 : n_own;
                correct(chunk, std::span(moved_).subspan(first, n_own), std::span(position_).subspan(first, n_own),
                        std::span(velocity_).subspan(n_moving == 0 ? 0 : first, n_moving));
            }
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
    Vec3 *const position = position_.data() + first, *const velocity = velocity_.data() + first;
    if (!particle_.bend()) {
        place(of, rest, map_.carried.data(), moved, position, out_normal_map);
        if (!velocity_.empty()) place(of, rest, map_rate_.carried.data(), moved, velocity, nullptr);
        return;
    }
    place_turning(of, rest, map_, velocity_.empty() ? nullptr : &map_rate_, moved, position, velocity, out_normal_map);
}

Mat3 SkinMotion::linear_at(const SkinBinding& binding, size_t vertex) const {
    const std::span<const SkinInfluence> influences = binding.influences(vertex);
    Mat3 linear = Mat3::Zero();
    for (const auto& [p, w] : influences) linear += double{w} * particle_.carried[p].linear;
    if (!particle_.bend()) return linear;
    TurningBlend t, no_rate;
    blend_turning(influences, map_.turning.data(), nullptr, t, no_rate);
    const Turn turn(t.turn);
    for (int k = 0; k < 3; ++k) {
        const Doubles turned = turn.apply(t.turned.column[k]);
        linear.col(k) += Vec3(turned[0], turned[1], turned[2]);
    }
    return linear;
}

}  // namespace sunder
