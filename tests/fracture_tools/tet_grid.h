// A box of cubic cells as tetrahedra, and labels by cube: cell complexes whose every fact is known.
#pragma once

#include <functional>

#include "fracture_tools/cells/cell_complex.h"
#include "tests/fracture_tools/tetrahedral_bodies.h"

namespace sunder::testing {

/// nx x ny x nz unit cubes from the origin, six tetrahedra each.
inline TetMesh make_tet_grid(std::array<int, 3> cubes) {
    const TetBox box = make_tet_box(cubes, 1.0);
    TetMesh mesh;
    mesh.vertices = box.vertices;
    for (size_t t = 0; t < box.tets.size(); ++t) {
        mesh.tets.push_back(box.tets[t]);
        if (box.volume(t) < 0) std::swap(mesh.tets.back()[2], mesh.tets.back()[3]);
    }
    return mesh;
}

/// label(x, y, z) of the cube that each cell lies in.
inline std::vector<uint32_t> cube_labels(const CellComplex& complex,
                                         const std::function<uint32_t(int, int, int)>& label) {
    std::vector<uint32_t> labels;
    for (const Vec3& c : complex.cell_centroid) labels.push_back(label(int(c.x()), int(c.y()), int(c.z())));
    return labels;
}

}  // namespace sunder::testing
