// Which interfaces of a body a node's parameters choose (`interface_parameters`).
#pragma once

#include <vector>

#include "nodes/graph/node.h"

namespace sunder {

/// "between" with what its choices take ("group", "other_group", "points", "spared", "distance", "box_min", "box_max",
/// "center", "radius"), and in the group Only what every choice is narrowed by: "angle" to "direction", "least_area",
/// "most_area".
std::vector<ParameterDescription> interface_parameters();

/// Whether these agree with one another.
Status check_interfaces(const std::string& node, const Parameters& parameters);

/// Edges whose interfaces are chosen, ascending, by their numbers in the body; an error where a group is not known.
Result<std::vector<EdgeId>> chosen_edges(const CookContext& context, const BodyValue& body,
                                         const Parameters& parameters);

}  // namespace sunder
