// JSON text as graph files need it: every fault is told with its place, and nothing is silently dropped.
#pragma once

#include <string>
#include <string_view>

#include "nodes/graph/description.h"
#include "nodes/graph/json.h"
#include "solver/data/result.h"

namespace sunder {

/// Errors (bad_input at `where`): syntax, truncation, numbers too large to be finite (line and column), a key that
/// appears twice in one object (its path), nesting deeper than 64.
Result<Json> parse_json(std::string_view text, const std::string& where);

}  // namespace sunder
