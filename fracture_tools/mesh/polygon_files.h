// PLY and OFF files, read by ourselves: assimp (5.2) crashes on truncated ones, and reads doubles as floats.
#pragma once

#include <string>
#include <string_view>

#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// `bytes` is the whole file, `where` its name in errors, `scale` is applied to positions. As read_mesh().

/// PLY, text or binary of either byte order. Of vertices x y z, nx ny nz and u v (or s t, texture_u texture_v) are
/// read; of faces vertex_indices (or vertex_index), texcoord (a list, two a corner) and material; of both what is a
/// layer by its name (layer_property.h); other things are passed over.
Result<TriMesh> read_ply(std::string_view bytes, const std::string& where, double scale);

/// Text OFF with one vertex or face a line; what follows a vertex's position (colours, normals) or a face's corners is
/// passed over.
Result<TriMesh> read_off(std::string_view bytes, const std::string& where, double scale);

}  // namespace sunder
