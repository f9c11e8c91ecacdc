#include "solver/data/simulation_mesh.h"

#include <algorithm>

#include "solver/data/invariant.h"

namespace sunder {
namespace {

// `n_before` particles have `io_factors`, `n` more have `added`; empty stands for ones.
void append_factors(std::vector<double>& io_factors, size_t n_before, const std::vector<double>& added, size_t n) {
    if (io_factors.empty() && added.empty()) return;
    io_factors.resize(n_before, 1.0);
    io_factors.insert(io_factors.end(), added.begin(), added.end());
    io_factors.resize(n_before + n, 1.0);
}

}  // namespace

void build_one_rings(SimulationMesh& m) {
    const uint32_t n = static_cast<uint32_t>(m.n_particles());
    m.group_offset.assign(n + 1, 0);
    for (uint32_t i = 0; i < n; ++i) m.group_offset[i + 1] = 1;  // the centre itself
    for (const Edge& e : m.edges) ++m.group_offset[e.a + 1], ++m.group_offset[e.b + 1];
    for (uint32_t i = 0; i < n; ++i) m.group_offset[i + 1] += m.group_offset[i];

    struct Member {
        ParticleId particle;
        EdgeId edge;
    };
    std::vector<Member> members(m.group_offset.back());
    std::vector<uint32_t> next(m.group_offset.begin(), m.group_offset.end() - 1);
    for (uint32_t i = 0; i < n; ++i) members[next[i]++] = {ParticleId(i), EdgeId::none()};
    for (EdgeId e(0); e < m.edges.size(); ++e) {
        SUNDER_ASSERT(m.edges[e].a < m.edges[e].b && m.edges[e].b < n);
        members[next[m.edges[e].a]++] = {m.edges[e].b, e};
        members[next[m.edges[e].b]++] = {m.edges[e].a, e};
    }
    m.group_member.resize(members.size());
    m.member_edge.resize(members.size());
    m.member_twin.resize(members.size());
    std::vector<std::array<uint32_t, 2>> edge_slots(m.edges.size());  // slot in ring of a, in ring of b
    for (uint32_t i = 0; i < n; ++i) {
        const auto begin = members.begin() + m.group_offset[i], end = members.begin() + m.group_offset[i + 1];
        std::sort(begin, end, [](const Member& x, const Member& y) { return x.particle < y.particle; });
        for (uint32_t s = m.group_offset[i]; s < m.group_offset[i + 1]; ++s) {
            m.group_member[s] = members[s].particle;
            m.member_edge[s] = members[s].edge;
            if (members[s].edge.is_none())
                m.member_twin[s] = s;
            else
                edge_slots[members[s].edge][m.edges[members[s].edge].a == i ? 0 : 1] = s;
        }
    }
    for (const auto& [in_a, in_b] : edge_slots) m.member_twin[in_a] = in_b, m.member_twin[in_b] = in_a;

    m.group_uneven.assign(n, 0);
    for (const Edge& e : m.edges)
        if (e.toughness_factor != 1) m.group_uneven[e.a] = m.group_uneven[e.b] = 1;
}

void trim(SimulationMesh& m) {
    const auto each = [](auto&... array) { (array.shrink_to_fit(), ...); };
    each(m.rest_position, m.rest_orientation, m.radii, m.volume, m.mass, m.body, m.fragment, m.edges);
    each(m.bareness, m.yield_factor, m.toughness_factor, m.material, m.hull_offset, m.hull_point);
}

namespace {

// Bodies without known hulls have hulls of no points.
void append_hulls(SimulationMesh& io_scene, const SimulationMesh& body, const Quat& turn) {
    if (body.hull_offset.empty() && io_scene.hull_offset.empty()) return;
    io_scene.hull_offset.resize(io_scene.n_particles() - body.n_particles() + 1,
                                static_cast<uint32_t>(io_scene.hull_point.size()));
    for (size_t i = 0; i < body.n_particles(); ++i) {
        for (const Vec3f& p : body.hull(i)) io_scene.hull_point.push_back((turn * p.cast<double>()).cast<float>());
        io_scene.hull_offset.push_back(static_cast<uint32_t>(io_scene.hull_point.size()));
    }
}

}  // namespace

void append_body(SimulationMesh& scene, const SimulationMesh& body, const Pose& pose) {
    const uint32_t particle_base = static_cast<uint32_t>(scene.n_particles());
    const uint32_t body_index = scene.body.empty() ? 0 : scene.body.back() + 1;
    for (const size_t n : {body.radii.size(), body.volume.size(), body.mass.size(), body.fragment.size()})
        SUNDER_ASSERT(n == body.n_particles());
    for (size_t i = 0; i < body.n_particles(); ++i) {
        scene.rest_position.push_back(pose.apply(body.rest_position[i]));
        scene.rest_orientation.push_back((pose.orientation * body.rest_orientation[i]).normalized());
        scene.body.push_back(body_index);
    }
    auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(scene.radii, body.radii);
    append(scene.volume, body.volume);
    append(scene.mass, body.mass);
    append(scene.fragment, body.fragment);
    append_hulls(scene, body, pose.orientation);
    append_factors(scene.bareness, particle_base, body.bareness, body.n_particles());
    append_factors(scene.yield_factor, particle_base, body.yield_factor, body.n_particles());
    append_factors(scene.toughness_factor, particle_base, body.toughness_factor, body.n_particles());
    for (const Edge& e : body.edges)
        scene.edges.push_back(
            {ParticleId(e.a + particle_base), ParticleId(e.b + particle_base), e.area, e.toughness_factor});
}

}  // namespace sunder
