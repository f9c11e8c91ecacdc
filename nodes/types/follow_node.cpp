// follow: a body is carried along by an animation until it is let go.
#include "fracture_tools/skin/vertex_motion.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"
#include "nodes/types/vertex_source.h"

namespace sunder {
namespace {

// All that no activation before it holds or lets sleep.
Activation activation_of(const std::string& name, const BodyValue& body) {
    Activation a;
    a.name = name;
    std::vector<uint8_t> taken(body.rest->n_particles(), 0);
    for (const ActivationValue& before : body.activations)
        for (const ParticleId i : before.activation.particles) taken[i] |= before.activation.keeps != Keeps::glued;
    for (ParticleId i(0); i < taken.size(); ++i)
        if (!taken[i]) a.particles.push_back(i);
    return a;
}

Result<Value> cook_follow(CookContext& context) {
    Result<std::shared_ptr<const BodyValue>> input = context.input<BodyValue>("body");
    if (!input) return input.error();
    BodyValue body = **input;
    if (body.follows)
        return context.error("body", "'" + body.name + "' follows '" + body.follows->name + "' already",
                             "one node of a kind is enough: remove one");
    const Parameters& p = context.parameters();
    FollowValue follows;
    follows.name = context.node();
    if (is_of_places(p)) {
        const SourceStrain strain =
            p.text("source_strain") == "elastic" ? SourceStrain::none_is_rest : SourceStrain::all_is_rest;
        auto motion = body_motion(context, "", body, strain, {}, context.store().get<BodyMotion>());
        if (!motion) return motion.error();
        follows.vertices = motion.take();
        follows.key = context.key();
    } else {
        // rest placement -> fragments -> where they are now
        const Pose now = pose_of(p);
        SourcePose pose;
        pose.whole.orientation = (now.orientation * body.pose.orientation.conjugate()).normalized();
        pose.whole.position = now.position - pose.whole.orientation * body.pose.position;
        follows.pose = std::make_shared<const SourcePose>(std::move(pose));
        double mass = 0;
        for (size_t i = 0; i < body.rest->n_particles(); ++i)
            mass += body.rest->mass[i], follows.center += body.rest->mass[i] * body.rest->rest_position[i];
        follows.center /= mass;
    }
    ActivationValue value;
    value.activation = activation_of(follows.name, body);
    value.comes = !p.is_null("frame") && context.frame() >= p.integer("frame");
    value.key = KeyHasher().add(follows.name).add(std::string_view("follows")).key();
    body.follows = std::make_shared<const FollowValue>(std::move(follows));
    if (!value.activation.particles.empty()) body.activations.push_back(std::move(value));
    return make_value(std::move(body));
}

Status check_follow(const std::string& node, const Parameters& p) { return check_vertex_source(node, p, ""); }

}  // namespace

NodeType follow_node() {
    NodeDescription d{.type = "follow",
                      .label = "Follow",
                      .category = "simulation",
                      .sentence =
                          "A body follows an animation, of its place or of each vertex of its mesh, until it is let go "
                          "with the speed and "
                          "spin that it has. `activate` nodes behind it say when and where that is for the fragments "
                          "that they hold."};
    d.inputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "What follows"},
                {.name = "mesh",
                 .label = "Mesh",
                 .type = SocketType::mesh,
                 .required = false,
                 .sentence = "Of `motion` vertices: the mesh that the body was cut from"}};
    d.outputs = {{.name = "body", .label = "Body", .type = SocketType::body, .sentence = "The same, carried along"}};
    d.parameters = {
        motion_parameter(
            "transform: the body moves as one, by `position` and `rotation`; vertices: each vertex of its mesh is "
            "where `path` or `positions` say"),
        needing({{is("motion", {"transform"})}},
                position_parameter(Animation::animatable, "Where the origin of the fragments is")),
        needing({{is("motion", {"transform"})}},
                rotation_parameter(Animation::animatable, "How the fragments are turned about their origin")),
        {.name = "frame",
         .label = "Frame",
         .type = ParameterType::integer,
         .default_value = nullptr,
         .sentence =
             "First frame at which it has let go; null: it follows to the end, but for what `activate` nodes let go",
         .nullable = true}};
    for (ParameterDescription& p : vertex_parameters("")) d.parameters.push_back(std::move(p));
    d.parameters.push_back(
        {.name = "source_strain",
         .label = "Source Strain",
         .type = ParameterType::choice,
         .default_value = "rest",
         .sentence =
             "What the animation's stretch is to the body once it is let go. rest: the shape that it has then is "
             "its rest, but for a change of volume; elastic: it springs back, and breaks where that is too much",
         .choices = {"rest", "elastic"},
         .needs = {{is("motion", {"vertices"})}}});
    return {.description = d, .cook = cook_follow, .check = check_follow, .depends_on_frame = true};
}

}  // namespace sunder
