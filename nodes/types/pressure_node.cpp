// pressure: blows a hollow body up from inside.
#include "fracture_tools/fragments/cavity.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/force_parameters.h"

namespace sunder {
namespace {

/// The lining as it was found last, with the key of the body that it was found for.
struct LiningStore {
    ContentKey body = 0;
    double area = 0;
    std::shared_ptr<const std::vector<Vec3>> lining;
};

Result<Value> cook_pressure(CookContext& context) {
    const Result<std::shared_ptr<const BodyValue>> body = context.input<BodyValue>("body", context.start_frame());
    if (!body) return body.error();
    LiningStore& store = context.store().get<LiningStore>();
    if (!store.lining || store.body != (*body)->key) {
        Cavity cavity = cavity_of(*(*body)->fragments);
        for (Vec3& area : cavity.lining) area = (*body)->pose.orientation * area;
        store = {(*body)->key, cavity.area, std::make_shared<const std::vector<Vec3>>(std::move(cavity.lining))};
    }
    if (!(store.area > 0))
        return context.error("body", "body '" + (*body)->name + "' encloses no hollow",
                             "give its mesh a surface inside, turned inwards");
    const Parameters& p = context.parameters();
    Pressure gas{store.lining, store.area, p.number("pressure"), p.number("vent"), (*body)->key};
    if (!(gas.pressure > 0)) return local_force(context, Nothing(), 0, (*body)->name);
    return local_force(context, gas, 0, (*body)->name);
}

}  // namespace

NodeType pressure_node() {
    NodeDescription d{.type = "pressure",
                      .label = "Pressure",
                      .category = "simulation",
                      .sentence =
                          "Blows a closed hollow body up from inside until it bursts. The pressure drops as the "
                          "body opens."};
    d.inputs = {{.name = "body",
                 .label = "Body",
                 .type = SocketType::body,
                 .sentence = "Of a mesh with a surface inside that encloses a hollow"}};
    d.outputs = {force_output()};
    d.parameters = {{.name = "pressure",
                     .label = "Pressure",
                     .unit = "Pa",
                     .min = 0,
                     .max = 1e9,
                     .default_value = 1e4,
                     .sentence = "Above that outside, while the body is closed",
                     .animatable = true},
                    {.name = "vent",
                     .label = "Vent",
                     .min = 1e-4,
                     .max = 1,
                     .default_value = 0.05,
                     .sentence = "Share of the surface inside that is open when the pressure has dropped to half"}};
    return {.description = d, .cook = cook_pressure};
}

}  // namespace sunder
