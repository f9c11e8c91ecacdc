#include "nodes/graph/body_edges.h"

#include <algorithm>

#include "solver/data/math_functions.h"

namespace sunder {

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
    const auto toughness_at = [&](ParticleId i) {
        const uint32_t region = body.region.empty() ? 0 : body.region[i];
        return material_of(rest, i, region > 0 ? body.regions[region - 1].material : body.material).toughness;
    };
    std::vector<double> toughness;
    for (const Edge& e : rest.edges)
        toughness.push_back(0.5 * (toughness_at(e.a) + toughness_at(e.b)) * e.toughness_factor);
    std::vector<uint8_t> held(rest.n_edges(), 0);
    for (const SeamValue& seam : body.seams)
        for (const EdgeId e : seam.seam.edges) {
            held[e] |= seam.factor == kNever;
            if (seam.factor < kNever) toughness[e] *= seam.factor;
        }
    for (EdgeId e(0); e < rest.n_edges(); ++e)
        if (held[e]) toughness[e] = kNever;
    return toughness;
}

}  // namespace sunder
