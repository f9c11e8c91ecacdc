// What nodes of forces that differ from place to place have in common.
#pragma once

#include <optional>

#include "nodes/graph/node.h"
#include "solver/scene/local_force.h"

namespace sunder {

/// "radius", "falloff" and, in the group Reach, "reach".
std::vector<ParameterDescription> falloff_parameters();
Falloff falloff_of(const Parameters& parameters);

/// The output of all nodes of forces, and what such a node gives; `Nothing` where it does nothing in this frame.
SocketDescription force_output();
Value local_force(const CookContext& context, LocalForce::Kind kind, double drag = 0, const std::string& body = {});

/// "acts_as" and "drag": whether a field's values are velocities of a wind or accelerations.
std::vector<ParameterDescription> acting_parameters();
/// 0 of an acceleration, 1/s; none of a wind that takes nothing along.
std::optional<double> drag_of(const Parameters& parameters);

/// Where noise is that changes within so many seconds, in those: it runs from the frame before the first, whatever that
/// is called.
double noise_time(const CookContext& context, double seconds);

}  // namespace sunder
