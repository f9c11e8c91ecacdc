// Mesh files in (assimp: OBJ, PLY, STL, glTF/GLB, FBX, OFF) and simple mesh files out.
#pragma once

#include <string>

#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

struct MeshReadSettings {
    double scale = 1.0;  // applied to positions; metres per file unit, of FBX a factor on the unit that the file tells
};

/// Reads every mesh of the file into one TriMesh: node transforms applied, polygons triangulated, vertices welded
/// by exact position, corner UVs and normals and materials kept where the format has them. Exactly degenerate
/// triangles (two corners at one position) are dropped. Errors: missing, unreadable or foreign file, no triangles,
/// non-finite coordinates (the vertex is named).
Result<TriMesh> read_mesh(const std::string& path, const MeshReadSettings& settings = {});

}  // namespace sunder
