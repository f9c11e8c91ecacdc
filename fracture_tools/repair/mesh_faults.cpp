#include "fracture_tools/repair/mesh_faults.h"

#include <algorithm>
#include <numeric>

#include "fracture_tools/repair/repair_surface.h"

namespace sunder {
namespace {

/// Moves the triangles of a fault into the mesh of faulty faces.
void take_faces(const MeshView& mesh, MeshFault& io_fault, TriMesh& io_faces) {
    for (uint32_t& t : io_fault.triangles) {
        const auto base = static_cast<uint32_t>(io_faces.positions.size());
        for (uint32_t v : mesh.triangles[t]) io_faces.positions.push_back(mesh.positions[v]);
        t = static_cast<uint32_t>(io_faces.triangles.size());
        io_faces.triangles.push_back({base, base + 1, base + 2});
    }
}

void add_crossings(const MeshView& mesh, MeshFaults& io_faults) {
    const Result<TriMesh> joined = join_triangles(mesh, "");
    if (!joined) return;  // what is in the way is listed
    MeshFault fault{MeshFaultKind::crossing, 0, Vec3::Zero(), {}};
    for (const auto& pair : crossing_triangles(*joined))
        fault.triangles.insert(fault.triangles.end(), pair.begin(), pair.end());
    if (fault.triangles.empty()) return;
    std::sort(fault.triangles.begin(), fault.triangles.end());
    fault.triangles.erase(std::unique(fault.triangles.begin(), fault.triangles.end()), fault.triangles.end());
    fault.count = fault.triangles.size();
    fault.first = joined->positions[joined->triangles[fault.triangles[0]][0]];
    take_faces(*joined, fault, io_faults.faces);
    io_faults.faults.push_back(std::move(fault));
}

}  // namespace

MeshFaults find_mesh_faults(const MeshView& mesh) {
    MeshFaults out{check_mesh(mesh), {}, {}};
    for (MeshFault fault : out.report.found) {
        take_faces(mesh, fault, out.faces);
        out.faults.push_back(std::move(fault));
    }
    if (out.report.is_usable()) add_crossings(mesh, out);
    return out;
}

const char* name_of(MeshFaultKind kind) {
    switch (kind) {
        case MeshFaultKind::bad_number:
            return "bad_number";
        case MeshFaultKind::no_triangles:
            return "no_triangles";
        case MeshFaultKind::open_edge:
            return "open_edge";
        case MeshFaultKind::non_manifold_edge:
            return "non_manifold_edge";
        case MeshFaultKind::inconsistent_edge:
            return "inconsistent_edge";
        case MeshFaultKind::non_manifold_vertex:
            return "non_manifold_vertex";
        case MeshFaultKind::isolated_vertex:
            return "isolated_vertex";
        case MeshFaultKind::degenerate_triangle:
            return "degenerate_triangle";
        case MeshFaultKind::duplicate_triangle:
            return "duplicate_triangle";
        case MeshFaultKind::no_volume:
            return "no_volume";
        case MeshFaultKind::inward:
            return "inward";
        case MeshFaultKind::crossing:
            return "crossing";
    }
    return "";
}

const char* repair_of(MeshFaultKind kind) {
    switch (kind) {
        case MeshFaultKind::bad_number:
        case MeshFaultKind::no_triangles:
        case MeshFaultKind::no_volume:
            return "none: refused";
        case MeshFaultKind::open_edge:
            return "seams welded, edges split at vertices, holes closed; a sheet needs a thickness";
        case MeshFaultKind::non_manifold_edge:
        case MeshFaultKind::non_manifold_vertex:
            return "the surface is parted there";
        case MeshFaultKind::inconsistent_edge:
        case MeshFaultKind::inward:
            return "turned outward";
        case MeshFaultKind::isolated_vertex:
            return "left out";
        case MeshFaultKind::degenerate_triangle:
            return "dropped if a vertex is there twice, else kept";
        case MeshFaultKind::duplicate_triangle:
            return "dropped";
        case MeshFaultKind::crossing:
            return "cut as it is; where that fails, wrapped";
    }
    return "";
}

}  // namespace sunder
