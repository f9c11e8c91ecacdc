// What can be wrong with a mesh, found and placed.
#pragma once

#include <string>
#include <vector>

#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

enum class MeshFaultKind {
    bad_number,
    no_triangles,
    open_edge,
    non_manifold_edge,
    inconsistent_edge,
    non_manifold_vertex,
    isolated_vertex,
    degenerate_triangle,
    duplicate_triangle,
    no_volume,
    inward,
    crossing,  // needs more than check_mesh(): find_mesh_faults()
};

/// All faults of one kind.
struct MeshFault {
    MeshFaultKind kind;
    size_t count = 0;                 // of edges, vertices, triangles; 1 for the mesh as a whole
    Vec3 first = Vec3::Zero();        // where the first one is, m
    std::vector<uint32_t> triangles;  // that have the fault, ascending; empty for the mesh as a whole
};

struct MeshReport {
    size_t n_vertices = 0, n_triangles = 0, n_components = 0;
    size_t open_edges = 0, non_manifold_edges = 0, inconsistent_edges = 0, non_manifold_vertices = 0;
    size_t degenerate_triangles = 0, duplicate_triangles = 0, isolated_vertices = 0;
    double volume = 0, area = 0;  // signed volume, m3; m2
    Aabb bounds;
    std::vector<MeshFault> found;
    std::vector<std::string> faults;  // those as sentences with the first place, "12 open edges, first near (x y z)"
    bool has_bad_numbers = false;     // non-finite coordinates or corners without vertex: nothing else is counted

    /// There are triangles, and their numbers mean something.
    bool is_usable() const { return n_triangles > 0 && !has_bad_numbers; }

    /// Closed, 2-manifold, consistently oriented, positive volume: it bounds a solid.
    bool is_solid() const {
        return is_usable() && open_edges + non_manifold_edges + inconsistent_edges + non_manifold_vertices == 0 &&
               volume > 0;
    }
};

MeshReport check_mesh(const MeshView& mesh);

/// "12 open edges, first near (x y z)"; not for bad numbers, which have a sentence each.
std::string fault_text(const MeshFault& fault);

/// Ok if the mesh bounds a solid; else an error that names `where`, the fault and its place.
Status require_solid(const MeshView& mesh, const std::string& where);

/// "(x y z)" with six digits, as errors and warnings tell places.
std::string place_text(const Vec3& place);

double mesh_volume(const MeshView& mesh);  // signed, m3
double mesh_area(const MeshView& mesh);    // m2

}  // namespace sunder
