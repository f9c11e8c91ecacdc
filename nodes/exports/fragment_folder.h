// Fragments on disk, as `sunder fracture` leaves them: fragments.json and pieces/piece.0001.ply, one closed mesh a
// fragment.
#pragma once

#include <filesystem>

#include "nodes/files/byte_buffer.h"
#include "nodes/graph/description.h"
#include "solver/data/fragment_set.h"
#include "solver/data/progress.h"
#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// What fragments.json says: source, fragments, interfaces, checks, warnings (design: files that we write).
Json fragments_to_json(const FragmentSet& set);

/// A piece: double positions, triangles, material a face.
ByteBuffer encode_piece(const TriMesh& piece);

/// Writes a set into `folder` (made if need be): pieces first, fragments.json last, each whole or not at all, so that
/// fragments.json never names a piece that is not there. Pieces are numbered from 1; fragment i is piece i + 1.
/// Errors: the folder holds a fragments.json or pieces that are not ours; disk full; not permitted; cancelled.
Status write_fragments(const FragmentSet& set, const std::filesystem::path& folder, const Progress& progress = {});

}  // namespace sunder
