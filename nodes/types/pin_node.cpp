// pin: holds the particles of a region and moves them rigidly.
#include <algorithm>

#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/region.h"
#include "nodes/types/vertex_source.h"

namespace sunder {
namespace {

struct Selection {
    ContentKey key = 0;
    std::shared_ptr<const std::vector<uint32_t>> particles;
    BodyMotion own;
    KnownMotion<SurfaceAttachment> attached;
};

Result<std::vector<uint32_t>> select(CookContext& context, const BodyValue& body, const Parameters& p) {
    const Result<std::vector<uint8_t>> inside = in_region(context, *body.fragments, body.rest->rest_position, p);
    if (!inside) return inside.error();
    std::vector<uint32_t> particles;
    for (uint32_t i = 0; i < inside->size(); ++i)
        if ((*inside)[i]) particles.push_back(i);
    return particles;
}

ContentKey selection_key(const BodyValue& body, const Parameters& p) {
    KeyHasher hasher;
    hasher.add(body.key);
    add_region(p, hasher);
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
        selection = {key, std::make_shared<const std::vector<uint32_t>>(particles.take()), {}, {}};
    }

    PinValue pin;
    pin.name = context.node();
    pin.body = (*body)->name;
    pin.body_key = (*body)->key;
    pin.particles = selection.particles;
    if (p.text("motion") == "vertices") {
        auto motion =
            body_motion(context, kMotionPrefix, **body, SourceStrain::none_is_rest, *pin.particles, selection.own);
        if (!motion) return motion.error();
        pin.motion = motion.take();
    } else if (p.text("motion") == "surface") {
        auto motion = attached_motion(context, kMotionPrefix, **body, *pin.particles, selection.attached);
        if (!motion) return motion.error();
        pin.motion = motion.take();
    } else {  // x -> pivot + position + R (x - pivot)
        pin.pivot = p.vector3("pivot");
        pin.pose.orientation = euler_xyz(p.vector3("rotation"));
        pin.pose.position = pin.pivot + p.vector3("position") - pin.pose.orientation * pin.pivot;
    }
    pin.turns_freely = p.text("hold") == "position";
    pin.releases = !p.is_null("release_frame");
    if (pin.releases) {
        const double since = context.frame() - p.number("release_frame"), frames = p.number("release_frames");
        pin.active = since <= frames;
        if (since > 0) pin.grip = frames > 0 ? std::max(0.0, 1 - since / frames) : 0;
        pin.release_time = context.seconds(frames);
    }
    return make_value(std::move(pin));
}

Status check_pin(const std::string& node, const Parameters& p) {
    if (Status ok = check_region(node, p); !ok) return ok;
    return check_vertex_source(node, p, kMotionPrefix);
}

}  // namespace

NodeType pin_node() {
    NodeDescription d{
        .type = "pin",
        .label = "Pin",
        .category = "simulation",
        .sentence =
            "Holds the particles whose rest centre lies in its region, and moves them rigidly about its pivot, or each "
            "with an animated mesh, their own or another. Region, pivot and motion are given in the scene, with the "
            "body as "
            "placed at the first frame."};
    d.inputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "The body that is held"},
                {.name = "mesh",
                 .label = "Mesh",
                 .type = SocketType::mesh,
                 .required = false,
                 .sentence = "Of `motion` vertices the mesh that the body was cut from, of surface any other"}};
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
    d.parameters.push_back(motion_parameter(
        "transform: what is held moves as one, by `position` and `rotation`; vertices: each fragment goes where the "
        "vertices of its own mesh take it; surface: each goes as the triangle of another mesh takes it that is nearest "
        "at the first frame. Where the mesh is, `motion_path` or `positions` say",
        {"transform", "vertices", "surface"}));
    for (ParameterDescription& p : vertex_parameters(kMotionPrefix, {}, {"vertices", "surface"}))
        d.parameters.push_back(std::move(p));
    for (const char* name : {"pivot", "position", "rotation"})
        at(d.parameters, name).needs = {{is("motion", {"transform"})}};
    gather(d.parameters, "Motion",
           {"motion", "pivot", "position", "rotation", "motion_source", "motion_path", "positions", "first_frame"});
    return {.description = d, .cook = cook_pin, .check = check_pin, .depends_on_frame = true};
}

}  // namespace sunder
