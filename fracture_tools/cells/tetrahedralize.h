// A solid mesh filled with tetrahedra (CGAL Mesh_3 behind plain data).
#pragma once

#include <array>
#include <atomic>
#include <string>
#include <vector>

#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

struct TetMesh {
    std::vector<Vec3> vertices;                 // (n_vertices x 3), m
    std::vector<std::array<uint32_t, 4>> tets;  // (n_tets x 4); (b - a) x (c - a) . (d - a) > 0
};

struct TetrahedralizeSettings {
    double cell_size = 0.1;             // radius of the circumscribed spheres at most, m, > 0
    double surface_distance = 0.01;     // how far the new surface may lie from the mesh, m, > 0
    double sharp_angle = 0;             // degrees; edges sharper than this stay edges; 0: none is kept
    size_t max_vertices = 0;            // ends a run that does not settle; 0: no end
    std::atomic<bool>* stop = nullptr;  // set by another thread, ends the run with an error
};

/// Fills the volume bounded by `mesh`; the surface is meshed anew, within `surface_distance`. Sequential: same input,
/// same bits. Errors: what CGAL refuses (as a sentence), too thin for max_vertices, no tetrahedra, too many vertices,
/// stopped.
Result<TetMesh> tetrahedralize(const MeshView& mesh, const TetrahedralizeSettings& settings, const std::string& where);

/// Shells of a surface that are not there in the tetrahedra that should fill it: where one of their vertices is.
struct LostShell {
    double volume = 0;  // m3
    Vec3 place = Vec3::Zero();
};
std::vector<LostShell> find_lost_shells(const MeshView& mesh, const TetMesh& tets);

}  // namespace sunder
