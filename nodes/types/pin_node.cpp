// pin: holds the particles of a region and moves them rigidly.
#include <algorithm>

#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"

namespace sunder {
namespace {

struct Selection {
    ContentKey key = 0;
    std::shared_ptr<const std::vector<uint32_t>> particles;
};

Status check_pin(const std::string& node, const Parameters& p) {
    const std::string region = p.text("region");
    if (region == "box" && (p.vector3("box_min").array() > p.vector3("box_max").array()).any())
        return node_error(node, "box_min", "lies beyond box_max", "each of its coordinates is at most that of box_max");
    if (region == "group" && p.text("group").empty()) return node_error(node, "group", "no vertex group is named");
    return {};
}

Result<std::vector<uint32_t>> of_group(CookContext& context, const BodyValue& body, const std::string& name) {
    const auto& groups = body.fragments->vertex_groups;
    const auto found = groups.find(name);
    if (found == groups.end()) {
        std::string known;
        for (const auto& [group, unused] : groups) known += (known.empty() ? "" : ", ") + group;
        return context.error("group", "the fragments have no vertex group '" + name + "'",
                             known.empty() ? "they have none" : "permitted: " + known);
    }
    std::vector<uint32_t> particles;
    for (const FragmentId fragment : found->second) particles.push_back(fragment.value);
    std::sort(particles.begin(), particles.end());
    return particles;
}

Result<std::vector<uint32_t>> select(CookContext& context, const BodyValue& body, const Parameters& p) {
    const std::string region = p.text("region");
    if (region == "group") return of_group(context, body, p.text("group"));
    const Vec3 low = p.vector3("box_min"), high = p.vector3("box_max"), center = p.vector3("center");
    const double radius = p.number("radius");
    std::vector<uint32_t> particles;
    for (size_t i = 0; i < body.rest->n_particles(); ++i) {
        const Vec3& x = body.rest->rest_position[i];
        const bool inside = region == "sphere" ? (x - center).norm() <= radius
                                               : (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
        if (inside) particles.push_back(static_cast<uint32_t>(i));
    }
    return particles;
}

ContentKey selection_key(const BodyValue& body, const Parameters& p) {
    KeyHasher hasher;
    hasher.add(body.key).add(p.text("region")).add(p.text("group")).add(p.number("radius"));
    for (const char* name : {"box_min", "box_max", "center"}) hasher.add(p.vector3(name));
    return hasher.key();
}

Result<Value> cook_pin(CookContext& context) {
    Result<std::shared_ptr<const BodyValue>> body = context.input<BodyValue>("body");
    if (!body) return body.error();
    const Parameters& p = context.parameters();
    Selection& selection = context.store().get<Selection>();
    const ContentKey key = selection_key(**body, p);
    if (selection.key != key || !selection.particles) {
        Result<std::vector<uint32_t>> particles = select(context, **body, p);
        if (!particles) return particles.error();
        if (particles->empty())
            return context.error(
                "region", "no particle of body '" + (*body)->name + "' lies in it",
                "regions are tested against the centres of the fragments as placed at the first frame");
        selection = {key, std::make_shared<const std::vector<uint32_t>>(particles.take())};
    }

    PinValue pin;
    pin.name = context.node();
    pin.body = (*body)->name;
    pin.body_key = (*body)->key;
    pin.particles = selection.particles;
    // x -> pivot + position + R (x - pivot)
    pin.pivot = p.vector3("pivot");
    pin.pose.orientation = euler_xyz(p.vector3("rotation"));
    pin.pose.position = pin.pivot + p.vector3("position") - pin.pose.orientation * pin.pivot;
    pin.turns_freely = p.text("hold") == "position";
    if (!p.is_null("release_frame")) {
        const double since = context.frame() - p.number("release_frame"), frames = p.number("release_frames");
        pin.active = since <= frames;
        if (since > 0) pin.grip = frames > 0 ? std::max(0.0, 1 - since / frames) : 0;
        pin.release_time = context.seconds(frames);
    }
    return make_value(std::move(pin));
}

}  // namespace

NodeType pin_node() {
    NodeDescription d{
        .type = "pin",
        .label = "Pin",
        .category = "simulation",
        .sentence =
            "Holds the particles whose rest centre lies in its region, and moves them rigidly about its pivot. Region, "
            "pivot and motion are given in the scene, with the body as placed at the first frame."};
    d.inputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "The body that is held"}};
    d.outputs = {
        {.name = "pin", .label = "Pin", .type = SocketType::pin, .sentence = "For the solver that holds the body"}};
    d.parameters = region_parameters(
        "box takes `box_min` and `box_max`; sphere takes `center` and `radius`; group takes `group`",
        {"box", "sphere", "group"}, "Vertex group of the mesh: fragments that own one of its vertices are held");
    d.parameters.insert(
        d.parameters.end(),
        {{.name = "pivot",
          .label = "Pivot",
          .type = ParameterType::vector3,
          .unit = "m",
          .default_value = {0.0, 0.0, 0.0},
          .sentence = "Point about which the rotation turns"},
         position_parameter(Animation::animatable, "How far the held particles are moved from where they rest"),
         rotation_parameter(Animation::animatable, "How far the held particles are turned about the pivot"),
         {.name = "hold",
          .label = "Hold",
          .type = ParameterType::choice,
          .default_value = "pose",
          .sentence = "pose holds places and turns, as a clamp; position holds places alone, as a hinge: what is held "
                      "turns with what it is part of (methods other than projective hold the pose)",
          .choices = {"pose", "position"}},
         {.name = "release_frame",
          .label = "Release Frame",
          .type = ParameterType::integer,
          .default_value = nullptr,
          .sentence = "Last frame at which it holds; null: it never lets go",
          .nullable = true},
         {.name = "release_frames",
          .label = "Release Over",
          .type = ParameterType::integer,
          .unit = "frames",
          .min = 0,
          .max = 100000,
          .default_value = 0,
          .sentence = "How long it takes to let go: what was held by force eases out, and does not spring; 0: at once",
          .needs = {{is_not_null("release_frame")}}}});
    gather(d.parameters, "Motion", {"pivot", "position", "rotation"});
    return {.description = d, .cook = cook_pin, .check = check_pin, .depends_on_frame = true};
}

}  // namespace sunder
