// Arrays of places over frames as numpy saves them.
#pragma once

#include <string>

#include "fracture_tools/skin/vertex_frames.h"
#include "solver/data/result.h"

namespace sunder {

/// A .npy file of shape (frames, vertices, 3), of little-endian floats of 4 or 8 bytes in C order; `first_frame` is
/// left as it is. Errors name `where`: no such file, another shape, order or type, fewer bytes than the shape tells.
Result<VertexFrames> decode_npy(const std::string& bytes, const std::string& where);

}  // namespace sunder
