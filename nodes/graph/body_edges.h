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

/// Tensile strain at which each edge begins to tear, by its fragments' toughness, its own factor and what seams make
/// of it at the body's frame; kNever of what seams hold and what never tears. What `activate` nodes glue changes
/// within the shot, and is not in it. (n_edges), -
std::vector<double> edge_toughness(const BodyValue& body);

}  // namespace sunder
