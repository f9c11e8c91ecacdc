// A scene numbered from the other end: what depends on the order of particles shows itself.
#pragma once

#include <algorithm>
#include <set>

#include "solver/scene/scene.h"

namespace sunder::test {

/// Particle i becomes n - 1 - i; edges are sorted anew. For scenes of one body.
inline Scene reversed(const Scene& scene) {
    Scene r = scene;
    SimulationMesh& rest = r.rest;
    const uint32_t last = static_cast<uint32_t>(rest.n_particles()) - 1;
    std::ranges::reverse(rest.rest_position), std::ranges::reverse(rest.rest_orientation);
    std::ranges::reverse(rest.radii), std::ranges::reverse(rest.volume), std::ranges::reverse(rest.mass);
    std::ranges::reverse(rest.fragment);
    for (Edge& e : rest.edges) e = {ParticleId(last - e.b), ParticleId(last - e.a), e.area};
    std::ranges::sort(rest.edges, [](const Edge& x, const Edge& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
    for (Pin& pin : r.pins) {
        for (ParticleId& i : pin.particles) i = ParticleId(last - i);
        std::ranges::sort(pin.particles);
    }
    build_one_rings(rest);
    return r;
}

/// Edges of the reversed mesh by their number in the one that it was made from.
inline std::set<uint32_t> same_edges_reversed(const SimulationMesh& reversed, const std::set<uint32_t>& edges) {
    const uint32_t last = static_cast<uint32_t>(reversed.n_particles()) - 1;
    std::vector<std::pair<uint32_t, uint32_t>> forward;  // edges as the first mesh sorts them
    for (const Edge& e : reversed.edges) forward.emplace_back(last - e.b, last - e.a);
    const auto ends_of = forward;
    std::ranges::sort(forward);
    std::set<uint32_t> same;
    for (const uint32_t e : edges)
        same.insert(static_cast<uint32_t>(std::ranges::lower_bound(forward, ends_of[e]) - forward.begin()));
    return same;
}

}  // namespace sunder::test
