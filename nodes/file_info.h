// What a file or folder holds, told in a few lines: meshes, graphs, bakes, fragments, frames.
#pragma once

#include <string>
#include <vector>

#include "solver/data/result.h"

namespace sunder {

/// Errors: no such file; what it should be by its name or mark cannot be read.
Result<std::vector<std::string>> describe_path(const std::string& path);

}  // namespace sunder
