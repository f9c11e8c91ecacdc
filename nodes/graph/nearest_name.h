// What a person may have meant by a name that does not exist.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sunder {

/// The candidate with the fewest edits to `name` (first of equals), or "" if none shares at least half of its letters.
std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

/// "did you mean 'density'? permitted: density, youngs_modulus, ..."; long lists are cut short.
std::string permitted_text(std::string_view name, const std::vector<std::string>& candidates);

/// "a, b, c"; more than twenty are cut short.
std::string list_text(const std::vector<std::string>& names);

}  // namespace sunder
