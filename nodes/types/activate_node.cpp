// activate: keeps fragments of a body from moving, or their edges from breaking, until a condition comes.
#include <algorithm>

#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/region.h"

namespace sunder {
namespace {

Keeps keeps_of(const Parameters& p) {
    const std::string mode = p.text("mode");
    return mode == "glued" ? Keeps::glued : mode == "asleep" ? Keeps::asleep : Keeps::held;
}

Until until_of(const Parameters& p) {
    const std::string until = p.text("until");
    return until == "object"      ? Until::object
           : until == "contact"   ? Until::contact
           : until == "neighbour" ? Until::neighbour
                                  : Until::frame;
}

ContentKey activation_key(CookContext& context, const Activation& a, const Parameters& p) {
    KeyHasher hasher;
    hasher.add(context.node()).add(static_cast<int>(a.keeps)).add(static_cast<int>(a.until));
    add_region(p, hasher);
    hasher.add(p.integer("cluster")).add(a.impulse).add(a.delay).add(a.growth).add(a.falloff);
    if (a.until == Until::object) hasher.add(context.input_key("object"));
    return hasher.key();
}

// Of two that move, or two that glue, the later one says what happens to a fragment.
void let_later_one_win(const Activation& later, std::vector<ActivationValue>& io_earlier) {
    for (ActivationValue& earlier : io_earlier) {
        if ((earlier.activation.keeps == Keeps::glued) != (later.keeps == Keeps::glued)) continue;
        std::erase_if(earlier.activation.particles,
                      [&](ParticleId i) { return std::ranges::binary_search(later.particles, i); });
    }
}

Result<Value> cook_activate(CookContext& context) {
    Result<std::shared_ptr<const BodyValue>> input = context.input<BodyValue>("body");
    if (!input) return input.error();
    BodyValue body = **input;
    const Parameters& p = context.parameters();
    const Result<std::vector<uint8_t>> inside = in_region(context, *body.fragments, body.rest->rest_position, p);
    if (!inside) return inside.error();

    ActivationValue value;
    Activation& a = value.activation;
    a.name = context.node();
    a.keeps = keeps_of(p), a.until = until_of(p);
    for (uint32_t i = 0; i < inside->size(); ++i)
        if ((*inside)[i]) a.particles.push_back(ParticleId(i));
    if (a.particles.empty())
        body.warnings.push_back("activate '" + a.name + "' keeps nothing: no fragment of body '" + body.name +
                                "' lies in its region");
    if (a.until == Until::frame) value.comes = context.frame() >= p.integer("frame");
    if (a.until == Until::contact) a.impulse = p.number("impulse");
    if (a.until == Until::object) {
        const auto objects = context.inputs_as<ColliderValue>("object", context.frame());
        if (!objects) return objects.error();
        if (objects->empty())
            return context.error("object", "is not wired", "wire a collider that comes over the fragments");
        const ColliderValue& object = *objects->front();
        a.object = object.collider.shape, a.grid = object.collider.grid, a.tree = object.collider.tree;
        a.delay = p.integer("delay") / context.frame_rate(), a.growth = p.number("growth");
        a.falloff = p.number("falloff");
        value.object = object.pose, value.object_surface = object.surface;
    }
    value.key = activation_key(context, a, p);
    let_later_one_win(a, body.activations);
    body.activations.push_back(std::move(value));
    return make_value(std::move(body));
}

std::vector<ParameterDescription> condition_parameters() {
    return {
        {.name = "until",
         .label = "Until",
         .type = ParameterType::choice,
         .default_value = "frame",
         .sentence = "frame: at `frame`; object: when the object comes over a fragment; contact: when something "
                     "else pushes a fragment by more than `impulse`; neighbour: when an edge of a fragment or of one "
                     "beside it breaks",
         .choices = {"frame", "object", "contact", "neighbour"}},
        {.name = "frame",
         .label = "Frame",
         .type = ParameterType::integer,
         .default_value = 1,
         .sentence = "First frame at which it has let go",
         .needs = {{is("until", {"frame"})}}},
        {.name = "impulse",
         .label = "Impulse",
         .unit = "N s",
         .min = 0,
         .max = 1e12,
         .default_value = 0.0,
         .sentence = "Of a fragment's contacts in this frame and the one before, that they have to exceed; 0: any "
                     "touch will do",
         .needs = {{is("until", {"contact"})}}},
        {.name = "delay",
         .label = "Delay",
         .type = ParameterType::integer,
         .unit = "frames",
         .min = 0,
         .max = 100000,
         .default_value = 0,
         .sentence = "From the object's touch until it lets go",
         .needs = {{is("until", {"object"})}}},
        {.name = "growth",
         .label = "Growth",
         .unit = "m/s",
         .min = 0,
         .max = 1e5,
         .default_value = 0.0,
         .sentence = "How fast it spreads through the region from what was touched; 0: it does not",
         .needs = {{is("until", {"object"})}}},
        {.name = "falloff",
         .label = "Falloff",
         .unit = "m",
         .min = 0,
         .max = 1e5,
         .default_value = 0.0,
         .sentence = "How far beyond its surface the object lets go: at the surface of all fragments, so far away of "
                     "none, between of the fewer the farther",
         .needs = {{is("until", {"object"})}}}};
}

}  // namespace

NodeType activate_node() {
    NodeDescription d{.type = "activate",
                      .label = "Activate",
                      .category = "simulation",
                      .sentence =
                          "Keeps fragments from moving, or their edges from breaking, until a condition comes "
                          "for each. Several can follow one another: where two speak of a fragment, the later "
                          "one counts."};
    d.inputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "Whose fragments these are"},
                {.name = "object",
                 .label = "Object",
                 .type = SocketType::collider,
                 .required = false,
                 .sentence = "Of `until` object: what comes over the fragments, on its keys. It need not be wired to "
                             "the solver, and pushes nothing unless it is"}};
    d.outputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "The same, kept"}};
    d.parameters = {{.name = "mode",
                     .label = "Mode",
                     .type = ParameterType::choice,
                     .default_value = "held",
                     .sentence = "held: does not move, and is there to be hit; asleep: not simulated until something "
                                 "touches its piece, or the condition comes; glued: no edge of it breaks",
                     .choices = {"held", "asleep", "glued"}}};
    std::ranges::move(
        region_parameters("Fragments whose centre lies in it, with the body as placed at the first frame. all: every "
                          "one; box takes `box_min` and `box_max`; sphere takes `center` and `radius`; group takes "
                          "`group`; cluster takes `cluster`",
                          {"all", "box", "sphere", "group", "cluster"},
                          "Vertex group of the mesh: fragments that own one of its vertices"),
        std::back_inserter(d.parameters));
    at(d.parameters, "region").default_value = "all";
    d.parameters.push_back(cluster_parameter());
    std::ranges::move(condition_parameters(), std::back_inserter(d.parameters));
    return {.description = d, .cook = cook_activate, .check = check_region, .depends_on_frame = true};
}

}  // namespace sunder
