// Parts of a surface that hang together.
#pragma once

#include <vector>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// The shell (part of the surface) of every triangle, numbered by their lowest triangles.
struct Shells {
    std::vector<uint32_t> of_triangle;  // (n_triangles)
    uint32_t n = 0;
};
Shells find_shells(const MeshView& mesh);

/// Of each shell, m3; negative where it faces inward.
std::vector<double> shell_volumes(const MeshView& mesh, const Shells& shells);

}  // namespace sunder
