// Fields of a struct (solver/data/fields.h) in JSON.
#pragma once

#include <cmath>

#include "nodes/graph/json.h"
#include "solver/data/fields.h"

namespace sunder {

/// {"name": value, ...} in their order; null for infinity.
template <class T>
Json json_of_fields(std::span<const Field<T>> fields, const T& values) {
    Json json = Json::object();
    for (const Field<T>& field : fields)
        json[field.description.name] = field.visit(values, [](auto value) {
            if constexpr (std::is_floating_point_v<decltype(value)>)
                return std::isinf(value) ? Json(nullptr) : Json(value);
            else
                return Json(value);
        });
    return json;
}

}  // namespace sunder
