// Mesh frames on disk, by extension: binary PLY (everything we know) or OBJ (what every program reads).
//
// PLY  vertex  x y z (float), fragment (int): the fragment that the vertex follows first; vx vy vz (float), m/s;
//              ax ay az (float), m/s2
//      face    vertex_indices (list), material fragment (int), hidden (uchar; only of constant topology),
//              texcoord (list of 6 floats: u v a corner; 0 outside if the source has none),
//              corner_normals (list of 9 floats: x y z a corner),
//              interface (int, -1 outside), corner_colors (list of 12 floats; only with colours), rim (list of 3
//              floats)
//      layers  of either, by their own names (layer_property.h)
//      comment "material 0 NAME" for each material, the last being break surfaces
// OBJ  v, vt, vn, usemtl where the material changes; a value that occurs again is written once.
#pragma once

#include <string>

#include "fracture_tools/skin/visual_mesh.h"
#include "nodes/files/byte_buffer.h"
#include "solver/data/result.h"

namespace sunder {

inline constexpr std::string_view kMeshFileMagic = "sunder mesh frame 1";
inline constexpr std::string_view kMaterialComment = "material ";

/// Name of a material in files: the artist's, "interior" for break surfaces, "material_3" for what has none.
std::string material_label(const FragmentSet& fragments, int32_t material);

ByteBuffer encode_mesh_ply(const VisualMesh& mesh, const FragmentSet& fragments);
ByteBuffer encode_mesh_obj(const VisualMesh& mesh, const FragmentSet& fragments);

/// By the extension of `path`. Errors: an extension that is neither .ply nor .obj; a coordinate that is not finite.
Result<ByteBuffer> encode_mesh(const std::string& path, const VisualMesh& mesh, const FragmentSet& fragments);

}  // namespace sunder
