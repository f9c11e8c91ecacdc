// follow: a body is carried along by an animation until it is let go.
#include <algorithm>
#include <numeric>

#include "fracture_tools/skin/vertex_motion.h"
#include "nodes/files/file_io.h"
#include "nodes/files/npy_file.h"
#include "nodes/graph/common_parameters.h"
#include "nodes/graph/node_list.h"

namespace sunder {
namespace {

constexpr size_t kMostBytesOfMotion = size_t{1} << 36;  // of a file

bool is_of_vertices(const Parameters& p) { return p.text("motion") == "vertices"; }

/// The motion as it was made last, with the key of the node that it was made for.
struct MotionStore {
    ContentKey node = 0;
    std::shared_ptr<const VertexMotion> motion;
};

Result<VertexFrames> frames_of_file(CookContext& context) {
    const std::string path = context.parameters().text("path");
    const Result<std::string> bytes = read_file(context.resolve(path), kMostBytesOfMotion);
    if (!bytes) return context.error("path", bytes.error().what, bytes.error().mend);
    Result<VertexFrames> frames = decode_npy(*bytes, path);
    if (!frames) return context.error("path", "'" + path + "': " + frames.error().what, frames.error().mend);
    return frames;
}

Result<VertexFrames> frames_of_values(CookContext& context, size_t n_vertices) {
    VertexFrames frames;
    frames.exact = context.parameters().points("positions");
    if (frames.exact.empty() || n_vertices == 0 || frames.exact.size() % n_vertices != 0)
        return context.error("positions",
                             "there are " + std::to_string(frames.exact.size()) + " positions for " +
                                 std::to_string(n_vertices) + " vertices",
                             "one for each vertex of the mesh, as many times as there are frames");
    frames.n_vertices = n_vertices, frames.n_frames = frames.exact.size() / n_vertices;
    return frames;
}

Result<std::shared_ptr<const VertexMotion>> motion_of(CookContext& context, const BodyValue& body) {
    MotionStore& store = context.store().get<MotionStore>();
    if (store.motion && store.node == context.key()) return store.motion;
    const Result<std::vector<Value>> wired = context.inputs("mesh", context.start_frame());
    if (!wired) return wired.error();
    if (wired->empty())
        return context.error("mesh", "is not wired",
                             "wire the mesh that the body was cut from: it tells whose places these are");
    const TriMesh& mesh = *std::get<std::shared_ptr<const TriMesh>>(wired->front());
    const Parameters& p = context.parameters();
    const bool is_file = p.text("source") == "file";
    Result<VertexFrames> frames = is_file ? frames_of_file(context) : frames_of_values(context, mesh.positions.size());
    if (!frames) return frames.error();
    frames->first_frame = p.integer("first_frame");
    const SourceStrain strain =
        p.text("source_strain") == "elastic" ? SourceStrain::none_is_rest : SourceStrain::all_is_rest;
    auto motion = VertexMotion::make({*body.fragments, *body.rest, body.pose}, mesh, frames.take(), strain);
    if (!motion) return context.error(is_file ? "path" : "positions", motion.error().what, motion.error().mend);
    store = {context.key(), motion.take()};
    return store.motion;
}

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
    if (is_of_vertices(p)) {
        auto motion = motion_of(context, body);
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

Status check_follow(const std::string& node, const Parameters& p) {
    if (is_of_vertices(p) && p.text("source") == "file" && p.text("path").empty())
        return node_error(node, "path", "no file is given", "a .npy file of shape (frames, vertices, 3)");
    return {};
}

std::vector<ParameterDescription> vertex_parameters() {
    std::vector<ParameterDescription> all = {
        {.name = "source",
         .label = "Source",
         .type = ParameterType::choice,
         .default_value = "file",
         .sentence = "file: places stand in a file of their own; values: in the graph",
         .choices = {"file", "values"}},
        {.name = "path",
         .label = "Path",
         .type = ParameterType::path,
         .default_value = "",
         .sentence =
             "A .npy file of shape (frames, vertices, 3), floats, m, in the scene; relative to the graph file's "
             "folder",
         .needs = {{is("source", {"file"})}}},
        {.name = "positions",
         .label = "Positions",
         .type = ParameterType::vectors,
         .unit = "m",
         .min = -1e6,
         .max = 1e6,
         .default_value = JsonValue::empty_list(),
         .sentence = "Where each vertex of the mesh is in the scene, in the order of the mesh as read, equal positions "
                     "being one; frame after frame",
         .needs = {{is("source", {"values"})}}},
        {.name = "first_frame",
         .label = "First Frame",
         .type = ParameterType::integer,
         .default_value = 1,
         .sentence = "Of the first of these; before it, and after the last, the mesh stands"},
        {.name = "source_strain",
         .label = "Source Strain",
         .type = ParameterType::choice,
         .default_value = "rest",
         .sentence =
             "What the animation's stretch is to the body once it is let go. rest: the shape that it has then is "
             "its rest, but for a change of volume; elastic: it springs back, and breaks where that is too much",
         .choices = {"rest", "elastic"}}};
    for (ParameterDescription& p : all) {
        if (p.needs.empty()) p.needs = {{}};
        p.needs.front().insert(p.needs.front().begin(), is("motion", {"vertices"}));
    }
    return all;
}

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
        {.name = "motion",
         .label = "Motion",
         .type = ParameterType::choice,
         .default_value = "transform",
         .sentence =
             "transform: the body moves as one, by `position` and `rotation`; vertices: each vertex of its mesh is "
             "where `path` or `positions` say",
         .choices = {"transform", "vertices"}},
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
    for (ParameterDescription& p : vertex_parameters()) d.parameters.push_back(std::move(p));
    return {.description = d, .cook = cook_follow, .check = check_follow, .depends_on_frame = true};
}

}  // namespace sunder
