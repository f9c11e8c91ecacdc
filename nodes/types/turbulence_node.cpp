// turbulence: eddies everywhere, of noise without divergence.
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/force_parameters.h"

namespace sunder {
namespace {

Result<Value> cook_turbulence(CookContext& context) {
    const Parameters& p = context.parameters();
    TurbulenceField field;
    field.strength = p.number("strength"), field.size = p.number("size"), field.octaves = p.integer("octaves");
    field.seed = static_cast<uint32_t>(p.integer("seed"));
    if (!p.is_null("period")) field.time = noise_time(context, p.number("period"));
    if (!p.is_null("reach")) field.reach = p.number("reach"), field.center = p.vector3("position");
    const std::optional<double> drag = drag_of(p);
    if (!drag || (field.strength == 0 && *drag == 0)) return local_force(context, Nothing());
    return local_force(context, field, *drag);
}

}  // namespace

NodeType turbulence_node() {
    NodeDescription d{.type = "turbulence",
                      .label = "Turbulence",
                      .category = "simulation",
                      .sentence = "Eddies everywhere: what drifts in them neither gathers nor thins out."};
    d.outputs = {force_output()};
    d.parameters = {{.name = "strength",
                     .label = "Strength",
                     .unit = "m/s or m/s2",
                     .min = 0,
                     .max = 1e4,
                     .default_value = 5.0,
                     .sentence = "Root of the mean square of what it is everywhere",
                     .animatable = true},
                    {.name = "size",
                     .label = "Size",
                     .unit = "m",
                     .min = 1e-3,
                     .max = 1e5,
                     .default_value = 1.0,
                     .sentence = "Of its largest eddies"},
                    {.name = "octaves",
                     .label = "Octaves",
                     .type = ParameterType::integer,
                     .min = 1,
                     .max = 8,
                     .default_value = 2,
                     .sentence = "Sizes of eddies: each half as large and half as fast as the one before"},
                    {.name = "seed",
                     .label = "Seed",
                     .type = ParameterType::integer,
                     .min = 0,
                     .default_value = 0,
                     .sentence = "Other eddies"},
                    {.name = "period",
                     .label = "Period",
                     .unit = "s",
                     .min = 0,
                     .max = 1e4,
                     .min_excluded = true,
                     .default_value = 1.0,
                     .sentence = "How long it takes until they are other eddies; null: they stay",
                     .nullable = true}};
    for (ParameterDescription& p : acting_parameters()) d.parameters.push_back(std::move(p));
    d.parameters.push_back({.name = "reach",
                            .label = "Reach",
                            .unit = "m",
                            .min = 0,
                            .max = 1e5,
                            .min_excluded = true,
                            .default_value = nullptr,
                            .sentence = "There are none farther away from a place; null: they are everywhere",
                            .nullable = true,
                            .group = "Reach"});
    d.parameters.push_back(
        in_group("Reach", needing({{is_not_null("reach")}}, position_parameter(Animation::animatable, "From where"))));
    return {.description = d, .cook = cook_turbulence, .depends_on_frame = true};
}

}  // namespace sunder
