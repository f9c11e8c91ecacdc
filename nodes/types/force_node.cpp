// force: acceleration fields and wind.
#include "nodes/graph/node_list.h"
#include "nodes/types/force_parameters.h"
#include "solver/scene/curl_noise.h"

namespace sunder {
namespace {

Result<Value> cook_force(CookContext& context) {
    const Parameters& p = context.parameters();
    Force force;
    force.acceleration = p.vector3("acceleration");
    force.wind = p.vector3("wind");
    force.drag = p.number("drag");
    if (const double gusts = p.number("gusts"); gusts > 0) {
        const double time = noise_time(context, p.number("gust_time"));
        force.wind *= 1 + gusts * noise_in_time(time, static_cast<uint32_t>(p.integer("gust_seed")));
    }
    return make_value(force);
}

}  // namespace

NodeType force_node() {
    NodeDescription d{.type = "force",
                      .label = "Force",
                      .category = "simulation",
                      .sentence = "An acceleration that all particles feel, and a wind that drags them along."};
    d.outputs = {{.name = "force", .label = "Force", .type = SocketType::force, .sentence = "For a solver"}};
    d.parameters = {
        {.name = "acceleration",
         .label = "Acceleration",
         .type = ParameterType::vector3,
         .unit = "m/s2",
         .min = -1e6,
         .max = 1e6,
         .default_value = {0.0, 0.0, 0.0},
         .sentence = "Added to the solver's gravity",
         .animatable = true},
        {.name = "wind",
         .label = "Wind",
         .type = ParameterType::vector3,
         .unit = "m/s",
         .min = -1e4,
         .max = 1e4,
         .default_value = {0.0, 0.0, 0.0},
         .sentence = "Velocity of the air",
         .animatable = true,
         .needs = {{is_above("drag", 0)}}},
        {.name = "drag",
         .label = "Drag",
         .unit = "1/s",
         .min = 0,
         .max = 1e4,
         .default_value = 0.0,
         .sentence = "How fast the wind takes particles along: acceleration = drag x (wind - velocity); 0: no wind",
         .animatable = true},
        {.name = "gusts",
         .label = "Gusts",
         .min = 0,
         .max = 10,
         .default_value = 0.0,
         .sentence = "By how much of itself the wind grows and drops, at most",
         .animatable = true,
         .group = "Gusts",
         .needs = {{is_above("drag", 0)}}},
        {.name = "gust_time",
         .label = "Gust Time",
         .unit = "s",
         .min = 0,
         .max = 1e4,
         .min_excluded = true,
         .default_value = 1.0,
         .sentence = "From gust to lull, more or less",
         .group = "Gusts",
         .needs = {{is_above("drag", 0), is_above("gusts", 0)}}},
        {.name = "gust_seed",
         .label = "Gust Seed",
         .type = ParameterType::integer,
         .min = 0,
         .default_value = 0,
         .sentence = "Other gusts",
         .group = "Gusts",
         .needs = {{is_above("drag", 0), is_above("gusts", 0)}}}};
    return {.description = d, .cook = cook_force, .depends_on_frame = true};
}

}  // namespace sunder
