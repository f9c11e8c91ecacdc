// point_force: an acceleration away from a place, or towards it.
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/force_parameters.h"

namespace sunder {
namespace {

Result<Value> cook_point_force(CookContext& context) {
    const Parameters& p = context.parameters();
    const PointField field{p.vector3("position"), falloff_of(p), p.number("strength")};
    if (field.strength == 0) return local_force(context, Nothing());
    return local_force(context, field);
}

}  // namespace

NodeType point_force_node() {
    NodeDescription d{.type = "point_force",
                      .label = "Point Force",
                      .category = "simulation",
                      .sentence = "Pushes everything away from a place, or draws it there, all the time."};
    d.outputs = {force_output()};
    d.parameters = {position_parameter(Animation::animatable, "Its centre"),
                    {.name = "strength",
                     .label = "Strength",
                     .unit = "m/s2",
                     .min = -1e6,
                     .max = 1e6,
                     .default_value = 10.0,
                     .sentence = "Acceleration at the radius, where it is largest; below 0 it draws in",
                     .animatable = true}};
    for (ParameterDescription& p : falloff_parameters()) d.parameters.push_back(std::move(p));
    return {.description = d, .cook = cook_point_force};
}

}  // namespace sunder
