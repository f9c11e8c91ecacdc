// What is wrong with a mesh, as a table, as JSON, and as faces to look at.
#pragma once

#include <string>
#include <vector>

#include "nodes/files/byte_buffer.h"
#include "nodes/graph/description.h"
#include "nodes/graph/json.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

struct MeshFaultReport {
    /// {"triangles", "vertices", "shells", "volume", "area", "faults": [{"kind", "id", "count", "triangles", "first",
    /// "text", "repair"}]}; `first` and `triangles` (how many) only where faults have a place.
    Json json;
    std::vector<std::string> table;  // lines of text
    size_t n_faults = 0;             // kinds of them
    /// PLY: the faulty faces, each with `int fault` (the id) and a colour of its own kind. Empty without such faces.
    ByteBuffer faces;
};

MeshFaultReport report_mesh_faults(const TriMesh& mesh);

}  // namespace sunder
