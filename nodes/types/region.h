// What lies in the region that a node's parameters describe (`region_parameters`).
#pragma once

#include <span>
#include <vector>

#include "nodes/graph/node.h"

namespace sunder {

/// Whether the parameters of a region agree with one another.
Status check_region(const std::string& node, const Parameters& parameters);

/// Whether `box_min` lies below `box_max`.
Status check_box(const std::string& node, const Parameters& parameters);

/// Which vertex groups fragments have, for who named another.
std::string known_groups(const FragmentSet& fragments);

/// 1 for each fragment that lies in it, by its centre; an error where the group is not known.
Result<std::vector<uint8_t>> in_region(const CookContext& context, const FragmentSet& fragments,
                                       std::span<const Vec3> centers, const Parameters& parameters);

/// "toughness", "yield" or the like: what the body's own is multiplied by in a region.
ParameterDescription factor_parameter(const char* name, const char* label, const char* sentence);

/// All that tells one region from another.
void add_region(const Parameters& parameters, KeyHasher& io_hasher);

}  // namespace sunder
