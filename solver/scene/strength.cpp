#include "solver/scene/strength.h"

#include <algorithm>

#include "solver/data/invariant.h"

namespace sunder {
namespace {

constexpr double kLeastBond = 1e-6;  // of a seam that is to break, and is glued until within the frame

}  // namespace

std::vector<double> fragment_toughness(const SimulationMesh& rest, std::span<const Material> materials,
                                       std::span<const uint8_t> edge_intact, std::span<const double> bonds) {
    SUNDER_ASSERT(edge_intact.size() == rest.n_edges() && (bonds.empty() || bonds.size() == rest.n_edges()));
    std::vector<double> toughness(rest.n_particles(), kNever);
    const auto offer = [&](ParticleId g, double factor) {
        const double own = material_of(rest, g, materials[rest.material_of(g)]).toughness;
        toughness[g] = std::min(toughness[g], rest.group_uneven[g] || !bonds.empty() ? own * factor : own);
    };
    for (EdgeId e(0); e < rest.n_edges(); ++e)
        if (edge_intact[e]) {
            const Edge& edge = rest.edges[e];
            const double factor = edge.toughness_factor * (bonds.empty() ? 1 : bonds[e]);
            offer(edge.a, factor), offer(edge.b, factor);
        }
    return toughness;
}

void EdgeBonds::scale(EdgeId edge, double factor) {
    if (factor_.empty()) factor_.assign(n_edges_, 1.0);
    double& own = factor_[edge];
    own = factor < kNever && own < kNever ? own * factor : kNever;
}

std::vector<double> edge_bonds(const Scene& scene, std::span<const double> seams, const FrameState& state) {
    SUNDER_ASSERT(seams.size() == scene.seams.size());
    const std::vector<Edge>& edges = scene.rest.edges;
    EdgeBonds bonds(edges.size());
    for (size_t k = 0; k < seams.size(); ++k)
        for (const EdgeId e : scene.seams[k].edges)
            if (seams[k] != 1 && state.edge_intact[e]) bonds.scale(e, std::max(seams[k], kLeastBond));
    if (state.inactive.empty()) return bonds.take();
    std::vector<uint8_t> follows(scene.sources.empty() ? 0 : scene.rest.n_particles(), 0);
    for (const Source& source : scene.sources)
        for (const ParticleId i : source.particles) follows[i] = state.inactive[i].follows();
    const auto both_follow = [&](const Edge& e) { return !follows.empty() && follows[e.a] && follows[e.b]; };
    const auto is_glued = [&](ParticleId i) { return (state.inactive[i].what & Inactivity::kGlued) != 0; };
    for (EdgeId e(0); e < edges.size(); ++e)
        if (state.edge_intact[e] && (is_glued(edges[e].a) || is_glued(edges[e].b) || both_follow(edges[e])))
            bonds.hold(e);
    return bonds.take();
}

double sound_toughness(const SimulationMesh& rest, const Material& of_a, const Material& of_b, EdgeId e) {
    const Edge& edge = rest.edges[e];
    const double a = material_of(rest, edge.a, of_a).toughness, b = material_of(rest, edge.b, of_b).toughness;
    return 0.5 * (a + b) * edge.toughness_factor;
}

}  // namespace sunder
