#include "nodes/graph/body_edges.h"

#include <algorithm>
#include <limits>

#include "solver/data/math_functions.h"
#include "solver/scene/strength.h"

namespace sunder {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

}  // namespace

InterfacePlace place_of(const BodyValue& body, const Edge& edge) {
    const std::pair<uint32_t, uint32_t> wanted(edge.a, edge.b);
    const auto key = [](const Interface& i) { return std::pair<uint32_t, uint32_t>(i.a, i.b); };
    const Vec3 &a = body.rest->rest_position[edge.a], &b = body.rest->rest_position[edge.b];
    const std::vector<Fragment>& fragments = body.fragments->fragments;
    InterfacePlace place{0.5 * (a + b), (b - a).normalized(), 0};
    const auto found = std::ranges::lower_bound(body.fragments->interfaces, wanted, {}, key);
    if (found == body.fragments->interfaces.end() || key(*found) != wanted) return place;
    place.middle = body.pose.apply(found->centroid);
    place.share = found->area / math::cbrt(fragments[edge.a].volume * fragments[edge.b].volume);
    if (found->area > 0) place.normal = body.pose.orientation * found->normal;
    return place;
}

std::vector<InterfacePlace> interface_places(const BodyValue& body) {
    std::vector<InterfacePlace> places;
    for (const Edge& edge : body.rest->edges) places.push_back(place_of(body, edge));
    return places;
}

std::vector<double> edge_toughness(const BodyValue& body) {
    const SimulationMesh& rest = *body.rest;
    EdgeBonds bonds(rest.n_edges());
    for (const SeamValue& seam : body.seams)
        for (const EdgeId e : seam.seam.edges) bonds.scale(e, seam.factor);
    std::vector<uint8_t> is_glued(rest.n_particles(), 0);
    for (const ActivationValue& a : body.activations)
        if (a.activation.keeps == Keeps::glued && !a.comes)
            for (const ParticleId i : a.activation.particles) is_glued[i] = 1;
    for (EdgeId e(0); e < rest.n_edges(); ++e)
        if (is_glued[rest.edges[e].a] || is_glued[rest.edges[e].b]) bonds.hold(e);
    return edge_toughness(rest, bonds.take(), [&](ParticleId i) -> const Material& {
        const uint32_t region = body.region.empty() ? 0 : body.region[i];
        return region > 0 ? body.regions[region - 1].material : body.material;
    });
}

std::vector<double> edge_toughness(const StateValue& value) {
    const SimulationMesh& rest = value.scene->rest;
    if (value.bodies.empty()) return std::vector<double>(rest.n_edges(), kUnknown);
    const std::vector<Material> materials = materials_of(value.bodies);
    return edge_toughness(rest, edge_bonds(*value.scene, seams_of(value.bodies), *value.state),
                          [&](ParticleId i) -> const Material& { return materials[rest.material_of(i)]; });
}

std::vector<double> fragment_toughness(const StateValue& value) {
    const SimulationMesh& rest = value.scene->rest;
    if (value.bodies.empty()) return std::vector<double>(rest.n_particles(), kUnknown);
    return fragment_toughness(rest, materials_of(value.bodies), value.state->edge_intact,
                              edge_bonds(*value.scene, seams_of(value.bodies), *value.state));
}

}  // namespace sunder
