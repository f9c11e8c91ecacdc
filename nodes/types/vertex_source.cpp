#include "nodes/types/vertex_source.h"

#include "nodes/files/file_io.h"
#include "nodes/files/npy_file.h"

namespace sunder {
namespace {

constexpr size_t kMostBytesOfMotion = size_t{1} << 36;  // of a file

bool is_of_file(const Parameters& p, const std::string& prefix) { return p.text(prefix + "source") == "file"; }

Result<VertexFrames> frames_of_file(CookContext& context, const std::string& parameter) {
    const std::string path = context.parameters().text(parameter);
    const Result<std::string> bytes = read_file(context.resolve(path), kMostBytesOfMotion);
    if (!bytes) return context.error(parameter, bytes.error().what, bytes.error().mend);
    Result<VertexFrames> frames = decode_npy(*bytes, path);
    if (!frames) return context.error(parameter, "'" + path + "': " + frames.error().what, frames.error().mend);
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

/// What is wired to "mesh", and where it is.
struct AnimatedMesh {
    std::shared_ptr<const TriMesh> mesh;
    VertexFrames frames;
};

Result<AnimatedMesh> animated_mesh(CookContext& context, const std::string& prefix, const std::string& mend) {
    const Result<std::vector<Value>> wired = context.inputs("mesh", context.start_frame());
    if (!wired) return wired.error();
    if (wired->empty()) return context.error("mesh", "is not wired", mend);
    AnimatedMesh animated = {std::get<std::shared_ptr<const TriMesh>>(wired->front()), {}};
    Result<VertexFrames> frames = vertex_frames(context, prefix, animated.mesh->positions.size());
    if (!frames) return frames.error();
    animated.frames = frames.take();
    return animated;
}

template <class Motion>
Result<std::shared_ptr<const Motion>> known(CookContext& context, const std::string& prefix,
                                            KnownMotion<Motion>& io_known, Result<std::shared_ptr<const Motion>> made) {
    if (!made)
        return context.error(vertex_parameter(context.parameters(), prefix), made.error().what, made.error().mend);
    io_known = {context.key(), context.start_frame(), made.take()};
    return io_known.motion;
}

}  // namespace

ParameterDescription motion_parameter(std::string sentence, std::vector<JsonValue> choices) {
    return {.name = "motion",
            .label = "Motion",
            .type = ParameterType::choice,
            .default_value = "transform",
            .sentence = std::move(sentence),
            .choices = std::move(choices)};
}

bool is_of_places(const Parameters& p) { return p.text("motion") != "transform"; }

std::vector<ParameterDescription> vertex_parameters(const std::string& prefix, std::vector<Condition> needs,
                                                    std::vector<JsonValue> motions) {
    needs.push_back(is("motion", std::move(motions)));
    std::vector<ParameterDescription> all = {
        {.name = prefix + "source",
         .label = prefix.empty() ? "Source" : "Motion Source",
         .type = ParameterType::choice,
         .default_value = "file",
         .sentence = "file: places stand in a file of their own; values: in the graph",
         .choices = {"file", "values"}},
        {.name = prefix + "path",
         .label = prefix.empty() ? "Path" : "Motion Path",
         .type = ParameterType::path,
         .default_value = "",
         .sentence =
             "A .npy file of shape (frames, vertices, 3), floats, m, in the scene; relative to the graph file's "
             "folder",
         .needs = {{is(prefix + "source", {"file"})}}},
        {.name = "positions",
         .label = "Positions",
         .type = ParameterType::vectors,
         .unit = "m",
         .min = -1e6,
         .max = 1e6,
         .default_value = JsonValue::empty_list(),
         .sentence = "Where each vertex of the mesh is in the scene, in the order of the mesh as read, equal positions "
                     "being one; frame after frame",
         .needs = {{is(prefix + "source", {"values"})}}},
        {.name = "first_frame",
         .label = "First Frame",
         .type = ParameterType::integer,
         .default_value = 1,
         .sentence = "Of the first of these; before it, and after the last, the mesh stands"}};
    for (ParameterDescription& p : all) {
        if (p.needs.empty()) p.needs = {{}};
        p.needs.front().insert(p.needs.front().begin(), needs.begin(), needs.end());
    }
    return all;
}

Status check_vertex_source(const std::string& node, const Parameters& p, const std::string& prefix) {
    const std::string path = prefix + "path";
    if (is_of_places(p) && is_of_file(p, prefix) && p.text(path).empty())
        return node_error(node, path, "no file is given", "a .npy file of shape (frames, vertices, 3)");
    return {};
}

std::string vertex_parameter(const Parameters& p, const std::string& prefix) {
    return is_of_file(p, prefix) ? prefix + "path" : "positions";
}

Result<VertexFrames> vertex_frames(CookContext& context, const std::string& prefix, size_t n_vertices) {
    Result<VertexFrames> frames = is_of_file(context.parameters(), prefix) ? frames_of_file(context, prefix + "path")
                                                                           : frames_of_values(context, n_vertices);
    if (frames) frames->first_frame = context.parameters().integer("first_frame");
    return frames;
}

Result<std::shared_ptr<const VertexMotion>> body_motion(CookContext& context, const std::string& prefix,
                                                        const BodyValue& body, SourceStrain strain,
                                                        std::span<const uint32_t> fragments, BodyMotion& io_known) {
    if (io_known.is_of(context)) return io_known.motion;
    Result<AnimatedMesh> animated =
        animated_mesh(context, prefix, "wire the mesh that the body was cut from: it tells whose places these are");
    if (!animated) return animated.error();
    return known(context, prefix, io_known,
                 VertexMotion::make({*body.fragments, *body.rest, body.pose}, *animated->mesh,
                                    std::move(animated->frames), strain, fragments));
}

Result<std::shared_ptr<const SurfaceAttachment>> attached_motion(CookContext& context, const std::string& prefix,
                                                                 const BodyValue& body,
                                                                 std::span<const uint32_t> fragments,
                                                                 KnownMotion<SurfaceAttachment>& io_known) {
    if (io_known.is_of(context)) return io_known.motion;
    Result<AnimatedMesh> animated =
        animated_mesh(context, prefix, "wire the mesh that they go with: it tells whose places these are");
    if (!animated) return animated.error();
    return known(context, prefix, io_known,
                 SurfaceAttachment::make(*body.rest, fragments, *animated->mesh, std::move(animated->frames),
                                         context.start_frame()));
}

}  // namespace sunder
