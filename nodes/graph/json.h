// JSON as a whole: a large header, for the files that read, change or write it. (Others: json_value.h.)
#pragma once

#include <nlohmann/json.hpp>

#include "nodes/graph/json_value.h"
