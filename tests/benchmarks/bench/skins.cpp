#include "tests/benchmarks/bench/skins.h"

#include <stdexcept>
#include <string_view>

namespace sunder::bench {
namespace {

SimulationMesh body_mesh(const SimulationMesh& rest, const Body& body) {
    SimulationMesh one;
    const auto slice = [&](const auto& all, auto& part) {
        part.assign(all.begin() + body.particle_begin, all.begin() + body.particle_end);
    };
    slice(rest.rest_position, one.rest_position), slice(rest.rest_orientation, one.rest_orientation);
    slice(rest.radii, one.radii), slice(rest.volume, one.volume), slice(rest.mass, one.mass);
    slice(rest.fragment, one.fragment);
    one.body.assign(one.rest_position.size(), 0);
    for (uint32_t e = body.edge_begin; e < body.edge_end; ++e)
        one.edges.push_back({ParticleId(rest.edges[e].a - body.particle_begin),
                             ParticleId(rest.edges[e].b - body.particle_begin), rest.edges[e].area});
    build_one_rings(one);
    return one;
}

// FNV-1a, by words.
template <class T>
void mix(uint64_t& io_hash, const SharedArray<T>& array) {
    const auto* word = reinterpret_cast<const uint32_t*>(array.data());
    static_assert(sizeof(T) % sizeof *word == 0);
    for (size_t i = 0; i < array.size() * sizeof(T) / sizeof *word; ++i)
        io_hash = (io_hash ^ word[i]) * 0x100000001b3ull;
}

}  // namespace

Skins::Skins(const BenchScene& scene) {
    for (size_t b = 0; b < scene.skins.size(); ++b)
        builders_.push_back(std::make_unique<VisualMeshBuilder>(
            scene.skins[b].fragments, body_mesh(scene.scene.rest, scene.scene.bodies[b]), scene.skins[b].pose));
}

void Skins::build(const BenchScene& scene, const FrameState& state, const WorkerPool& workers) {
    const RangeRunner run = [&](size_t n, size_t grain, const auto& body) { workers.for_range(n, grain, body); };
    std::vector<MovingBody> bodies;
    last_.resize(builders_.size());
    for (size_t b = 0; b < builders_.size(); ++b) {
        const Body& body = scene.scene.bodies[b];
        const size_t n = body.particle_end - body.particle_begin;
        bodies.push_back({builders_[b].get(),
                          {{state.position.data() + body.particle_begin, n},
                           {state.orientation.data() + body.particle_begin, n},
                           {state.plastic_deformation.data() + body.particle_begin, n},
                           {state.edge_intact.data() + body.edge_begin, body.edge_end - body.edge_begin}},
                          &last_[b]});
    }
    for (const Status& s : build_meshes(bodies, run))
        if (!s) throw std::runtime_error(s.error().text());
    vertices_ = triangles_ = 0;
    for (const VisualMesh& m : last_) vertices_ += m.positions.size(), triangles_ += m.triangles.size();
}

uint64_t Skins::hash() const {
    uint64_t hash = 0xcbf29ce484222325ull;
    for (const VisualMesh& m : last_) {
        mix(hash, m.positions), mix(hash, m.triangles), mix(hash, m.corner_normals), mix(hash, m.corner_uvs);
        mix(hash, m.corner_colors), mix(hash, m.corner_rim), mix(hash, m.triangle_interface);
        mix(hash, m.triangle_material), mix(hash, m.triangle_fragment), mix(hash, m.vertex_fragment);
    }
    return hash;
}

}  // namespace sunder::bench
