// What nodes have in common whose motion is that of a mesh's vertices: where their places come from.
#pragma once

#include <string>
#include <vector>

#include "fracture_tools/skin/vertex_motion.h"
#include "nodes/graph/node.h"

namespace sunder {

/// "motion", of which "vertices" is by the parameters below; `sentence` tells both.
ParameterDescription motion_parameter(std::string sentence);
bool is_of_vertices(const Parameters& parameters);

/// Of nodes that have a path of their own, or a source in a host.
inline constexpr const char* kMotionPrefix = "motion_";

/// "source", "path", "positions" and "first_frame"; `prefix` tells the first two from a node's own. They need `needs`
/// and that the motion is of vertices.
std::vector<ParameterDescription> vertex_parameters(const std::string& prefix, std::vector<Condition> needs = {});

/// Says where a file is missing.
Status check_vertex_source(const std::string& node, const Parameters& parameters, const std::string& prefix);

/// The one of its parameters that tells the places.
std::string vertex_parameter(const Parameters& parameters, const std::string& prefix);

/// The motion of a body's mesh as it was made last, with the key of the node that it was made for.
struct BodyMotion {
    ContentKey node = 0;
    std::shared_ptr<const VertexMotion> motion;
};
/// Of the mesh that is wired to "mesh"; of the fragments that are named, or all.
Result<std::shared_ptr<const VertexMotion>> body_motion(CookContext& context, const std::string& prefix,
                                                        const BodyValue& body, SourceStrain strain,
                                                        std::span<const uint32_t> fragments, BodyMotion& io_known);

/// Frames of a mesh with so many vertices; an error names node and parameter.
Result<VertexFrames> vertex_frames(CookContext& context, const std::string& prefix, size_t n_vertices);

}  // namespace sunder
