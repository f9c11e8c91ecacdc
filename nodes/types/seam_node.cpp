// seam: tells interfaces of a body when to break, and how much they bear.
#include <algorithm>

#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/chosen_edges.h"
#include "nodes/types/region.h"

namespace sunder {
namespace {

// Found once for all frames.
struct Chosen {
    ContentKey key = 0;  // of the node and all above it
    std::vector<EdgeId> edges;
};

double factor_at(double frame, const Parameters& p) {
    const std::string mode = p.text("mode");
    if (mode == "scale") return p.number("toughness");
    if (p.is_null("frame")) return mode == "hold" ? kNever : 1;
    const int when = p.integer("frame");
    if (mode == "hold") return frame < when ? kNever : 1;
    const double since = frame - when, over = p.integer("frames");
    if (since >= over) return 0;
    return since > 0 ? 1 - since / over : 1;
}

Result<Value> cook_seam(CookContext& context) {
    Result<std::shared_ptr<const BodyValue>> input = context.input<BodyValue>("body");
    if (!input) return input.error();
    BodyValue body = **input;
    const Parameters& p = context.parameters();
    Chosen& chosen = context.store().get<Chosen>();
    if (const ContentKey key = context.key(); chosen.key != key) {
        Result<std::vector<EdgeId>> edges = chosen_edges(context, body, p);
        if (!edges) return edges.error();
        chosen = {key, edges.take()};
    }
    if (chosen.edges.empty())
        body.warnings.push_back("seam '" + context.node() + "' has no interface: none of body '" + body.name +
                                "' lies there");
    KeyHasher hasher;
    hasher.add(context.node()).add(chosen.edges.size());
    for (const EdgeId e : chosen.edges) hasher.add(e.value);
    body.seams.push_back({hasher.key(), {context.node(), chosen.edges}, factor_at(context.frame(), p)});
    return make_value(std::move(body));
}

std::vector<ParameterDescription> mode_parameters() {
    ParameterDescription toughness = factor_parameter(
        "toughness", "Toughness",
        "Factor on their toughness; the fracture energy goes by its square, so that they open as far as others "
        "before they part");
    toughness.animatable = true;
    toughness.needs = {{is("mode", {"scale"})}};
    return {
        {.name = "mode",
         .label = "Mode",
         .type = ParameterType::choice,
         .default_value = "break",
         .sentence = "break: they break at `frame`, or weaken from there on; hold: they cannot break before; scale: "
                     "they bear `toughness` times as much strain",
         .choices = {"break", "hold", "scale"}},
        std::move(toughness)};
}

}  // namespace

NodeType seam_node() {
    NodeDescription d{
        .type = "seam",
        .label = "Seam",
        .category = "simulation",
        .sentence =
            "Tells interfaces of a body when to break, or not to, or makes them weaker or tougher. Several "
            "can follow one another: factors multiply, and what one holds no other breaks."};
    d.inputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "Whose interfaces these are"}};
    d.outputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "The same, with the seam"}};
    d.parameters = mode_parameters();
    std::ranges::move(interface_parameters(), std::back_inserter(d.parameters));
    d.parameters.push_back({.name = "frame",
                            .label = "Frame",
                            .type = ParameterType::integer,
                            .default_value = 1,
                            .sentence = "At which they are broken; from which on they may break; null: never",
                            .nullable = true,
                            .needs = {{is("mode", {"break", "hold"})}}});
    d.parameters.push_back({.name = "frames",
                            .label = "Over",
                            .type = ParameterType::integer,
                            .unit = "frames",
                            .min = 0,
                            .max = 100000,
                            .default_value = 0,
                            .sentence = "How long it takes from that frame on: a factor on their toughness falls to 0, "
                                        "where what is left of them breaks; 0: at once",
                            .needs = {{is("mode", {"break"}), is_not_null("frame")}}});
    return {.description = d, .cook = cook_seam, .check = check_interfaces, .depends_on_frame = true};
}

}  // namespace sunder
