// What nodes have in common whose motion is that of a mesh's vertices: where their places come from.
#pragma once

#include <string>
#include <vector>

#include "fracture_tools/skin/surface_attachment.h"
#include "fracture_tools/skin/vertex_motion.h"
#include "nodes/graph/node.h"

namespace sunder {

/// "motion", of which all but "transform" is by the parameters below; `sentence` tells each.
ParameterDescription motion_parameter(std::string sentence, std::vector<JsonValue> choices = {"transform", "vertices"});
bool is_of_places(const Parameters& parameters);

/// Of nodes that have a path of their own, or a source in a host.
inline constexpr const char* kMotionPrefix = "motion_";

/// "source", "path", "positions" and "first_frame"; `prefix` tells the first two from a node's own. They need `needs`
/// and that the motion is one of `motions`.
std::vector<ParameterDescription> vertex_parameters(const std::string& prefix, std::vector<Condition> needs = {},
                                                    std::vector<JsonValue> motions = {"vertices"});

/// Says where a file is missing.
Status check_vertex_source(const std::string& node, const Parameters& parameters, const std::string& prefix);

/// The one of its parameters that tells the places.
std::string vertex_parameter(const Parameters& parameters, const std::string& prefix);

/// A motion as it was made last, with the key of the node and the start that it was made for.
template <class Motion>
struct KnownMotion {
    ContentKey node = 0;
    int start = 0;
    std::shared_ptr<const Motion> motion;

    bool is_of(CookContext& context) const { return motion && node == context.key() && start == context.start_frame(); }
};
using BodyMotion = KnownMotion<VertexMotion>;

/// Of the mesh that is wired to "mesh", which the body was cut from; of the fragments that are named, or all.
Result<std::shared_ptr<const VertexMotion>> body_motion(CookContext& context, const std::string& prefix,
                                                        const BodyValue& body, SourceStrain strain,
                                                        std::span<const uint32_t> fragments, BodyMotion& io_known);

/// Of fragments that are attached to the mesh that is wired to "mesh", as both are at the start.
Result<std::shared_ptr<const SurfaceAttachment>> attached_motion(CookContext& context, const std::string& prefix,
                                                                 const BodyValue& body,
                                                                 std::span<const uint32_t> fragments,
                                                                 KnownMotion<SurfaceAttachment>& io_known);

/// Frames of a mesh with so many vertices; an error names node and parameter.
Result<VertexFrames> vertex_frames(CookContext& context, const std::string& prefix, size_t n_vertices);

}  // namespace sunder
