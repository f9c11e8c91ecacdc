// Mesh frames back from disk: the PLY files that a bake wrote.
#pragma once

#include <string>
#include <vector>

#include "fracture_tools/skin/visual_mesh.h"
#include "solver/data/result.h"

namespace sunder {

struct MeshFrame {
    VisualMesh mesh;
    std::vector<std::string> materials;  // names; the last one is that of break surfaces

    int32_t interior_material() const { return static_cast<int32_t>(materials.size()) - 1; }
};

/// Errors name `where`: not a mesh frame of ours, truncated, a face that names a vertex or material that is not there.
/// What later versions add to vertices and faces is passed over.
Result<MeshFrame> decode_mesh_ply(std::string bytes, const std::string& where);

}  // namespace sunder
