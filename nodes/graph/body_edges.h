// Where the interfaces behind a body's edges are, and what they bear.
#pragma once

#include <vector>

#include "nodes/graph/value.h"

namespace sunder {

/// In the scene, with the body as placed at the first frame.
struct InterfacePlace {
    Vec3 middle, normal;  // m; unit, from the first fragment to the second
    double share;         // its area over the cross-section of its fragments (the cube root of their volumes'
                          // product), -; 0 of neighbours that a lattice joins across an edge or corner
};

InterfacePlace place_of(const BodyValue& body, const Edge& edge);
std::vector<InterfacePlace> interface_places(const BodyValue& body);  // (n_edges)

/// Tensile strain at which each edge begins to tear (solver/scene/strength.h), at the body's frame; kNever of what is
/// held. What `activate` nodes glue until something comes counts as glued: whether it came a state tells. (n_edges), -
std::vector<double> edge_toughness(const BodyValue& body);

/// The same of a state, with what is glued and held in it. Not a number of one from a file, which does not tell.
std::vector<double> edge_toughness(const StateValue& state);

/// Of each particle, what tears it (fragment_toughness in solver/scene/strength.h), likewise; (n_particles), -
std::vector<double> fragment_toughness(const StateValue& state);

}  // namespace sunder
