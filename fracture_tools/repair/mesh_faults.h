// Every fault of a mesh with its triangles, to be listed and looked at.
#pragma once

#include <vector>

#include "fracture_tools/mesh/mesh_checks.h"

namespace sunder {

struct MeshFaults {
    MeshReport report;              // of the mesh as it is
    std::vector<MeshFault> faults;  // the report's, and crossings; `triangles` are in `faces`
    TriMesh faces;                  // the triangles that have faults, fault after fault
};

/// What check_mesh() finds, and triangles that cross one another once equal positions are welded.
MeshFaults find_mesh_faults(const MeshView& mesh);

/// "open_edge": as reports in files call it.
const char* name_of(MeshFaultKind kind);

/// What repair does about a kind of fault, as a phrase.
const char* repair_of(MeshFaultKind kind);

}  // namespace sunder
