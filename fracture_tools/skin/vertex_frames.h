// Where the vertices of an animated mesh are, frame after frame.
#pragma once

#include <vector>

#include "solver/data/math.h"
#include "solver/data/result.h"

namespace sunder {

/// Vertices of a mesh, frame after frame, in single or double precision as they came: one of the two is empty.
struct VertexFrames {
    size_t n_vertices = 0, n_frames = 0;
    int first_frame = 1;             // before it and after the last, the mesh stands
    std::vector<Vec3f> single = {};  // (n_frames * n_vertices x 3), m, in the scene
    std::vector<Vec3> exact = {};

    int last_frame() const { return first_frame + static_cast<int>(n_frames) - 1; }
    /// The frame's number among these: of one that is not told of the nearest.
    size_t index_of(int frame) const;
    Vec3 at(size_t frame, size_t vertex) const {
        const size_t k = frame * n_vertices + vertex;
        return single.empty() ? exact[k] : Vec3(single[k].cast<double>());
    }

    /// That there is a frame, that each has a place for each vertex of the mesh, and that all are finite; an error
    /// names vertex and frame.
    Status check(size_t n_vertices_of_mesh) const;
};

}  // namespace sunder
