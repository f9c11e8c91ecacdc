#include "fracture_tools/skin/vertex_frames.h"

#include <algorithm>
#include <string>

namespace sunder {

size_t VertexFrames::index_of(int frame) const {
    return static_cast<size_t>(std::clamp(frame, first_frame, last_frame()) - first_frame);
}

Status VertexFrames::check(size_t n_vertices_of_mesh) const {
    if (n_frames == 0) return bad_input("motion", "it has no frame");
    if (n_vertices != n_vertices_of_mesh)
        return bad_input("motion",
                         "it has " + std::to_string(n_vertices) + " vertices a frame, the mesh has " +
                             std::to_string(n_vertices_of_mesh),
                         "vertices are those of the mesh as read, equal positions being one");
    for (size_t k = 0; k < n_frames; ++k)
        for (size_t v = 0; v < n_vertices; ++v)
            if (!at(k, v).allFinite())
                return bad_input("motion", "vertex " + std::to_string(v) + " is not finite at frame " +
                                               std::to_string(first_frame + static_cast<int>(k)));
    return {};
}

}  // namespace sunder
