// Which nodes are cooked together when several values of a frame are asked for.
#pragma once

#include <span>
#include <vector>

#include "nodes/graph/evaluation.h"

namespace sunder {

/// Of what is wanted and all that feeds it: the nodes of types that cook together and that have no value yet, two or
/// more of one type and output to a group. A node's group follows those of the nodes that feed it; groups and their
/// nodes do not depend on anything but the wires and the order of what is wanted.
std::vector<std::vector<WantedValue>> cook_groups(Evaluation& evaluation, std::span<const WantedValue> wanted,
                                                  double frame);

}  // namespace sunder
