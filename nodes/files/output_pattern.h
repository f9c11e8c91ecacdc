// Paths of baked files: below the output folder, one a frame.
#pragma once

#include <string>

#include "solver/data/result.h"

namespace sunder {

/// "mesh/bunny.####.ply": relative, forward slashes, no "..", one run of # in the file's name.
Status check_output_pattern(const std::string& pattern);

/// The pattern with its run of # replaced by the frame, padded with zeros to the run's length ("-012" for -12). What
/// lies between two frames has the earlier one's number and thousandths behind it: "0012_250" for 12.25. So names in
/// the order of their bytes are in that of time, and whoever looks for #### finds whole frames alone.
std::string output_path(const std::string& pattern, double frame);

/// The file of all frames beside them: "mesh/bunny.####.ply" and ".usda" give "mesh/bunny.usda".
std::string shot_path(const std::string& pattern, const std::string& extension);

/// A node's name as part of a file's: names may hold any character, here only letters, digits, _ and - stay as they
/// are.
std::string file_name_of(const std::string& node);

}  // namespace sunder
