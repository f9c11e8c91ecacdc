// vortex: a wind, or an acceleration, round an axis.
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/force_parameters.h"

namespace sunder {
namespace {

Result<Value> cook_vortex(CookContext& context) {
    const Parameters& p = context.parameters();
    if (Status ok = check_direction(context.node(), p, "axis"); !ok) return ok.error();  // between two keys
    VortexField field{p.vector3("position"), p.vector3("axis").normalized(), falloff_of(p)};
    field.swirl = p.number("swirl"), field.inflow = p.number("inflow"), field.lift = p.number("lift");
    const std::optional<double> drag = drag_of(p);
    const bool is_still = field.swirl == 0 && field.inflow == 0 && field.lift == 0;
    if (!drag || (is_still && *drag == 0)) return local_force(context, Nothing());
    return local_force(context, field, *drag);
}

Status check_vortex(const std::string& node, const Parameters& p) { return check_direction(node, p, "axis"); }

ParameterDescription speed(const char* name, const char* label, double by_default, const char* sentence) {
    return {.name = name,
            .label = label,
            .unit = "m/s or m/s2",
            .min = -1e4,
            .max = 1e4,
            .default_value = by_default,
            .sentence = sentence,
            .animatable = true};
}

}  // namespace

NodeType vortex_node() {
    NodeDescription d{.type = "vortex",
                      .label = "Vortex",
                      .category = "simulation",
                      .sentence = "Takes everything round an axis: a whirlwind."};
    d.outputs = {force_output()};
    d.parameters = {position_parameter(Animation::animatable, "A point of the axis"),
                    direction_parameter(Animation::animatable, "axis", "Axis",
                                        "It turns about this, counter-clockwise as seen from its tip"),
                    speed("swirl", "Swirl", 10.0, "Round the axis, at the radius, where it is largest"),
                    in_group("Draught", speed("inflow", "Inflow", 0.0, "Towards the axis, at the radius")),
                    in_group("Draught", speed("lift", "Lift", 0.0, "Along the axis: so much within the radius"))};
    for (ParameterDescription& p : falloff_parameters()) d.parameters.push_back(std::move(p));
    at(d.parameters, "falloff").default_value = 1.0;
    for (ParameterDescription& p : acting_parameters()) d.parameters.push_back(std::move(p));
    return {.description = d, .cook = cook_vortex, .check = check_vortex};
}

}  // namespace sunder
