#include "nodes/graph/field_parameters.h"

#include <cmath>

#include "nodes/graph/json.h"

namespace sunder {

JsonValue value_of_number(double may_be_infinite) {
    return std::isinf(may_be_infinite) ? JsonValue(nullptr) : JsonValue(may_be_infinite);
}

ParameterDescription parameter_of(const FieldDescription& field, ParameterType type, JsonValue default_value) {
    ParameterDescription p{.name = field.name, .label = field.label, .type = type, .unit = field.unit};
    if (std::isfinite(field.min)) p.min = field.min;
    if (std::isfinite(field.max)) p.max = field.max;
    p.min_excluded = field.min_excluded;
    p.nullable = default_value.get().is_null();
    p.default_value = std::move(default_value);
    p.sentence = field.sentence;
    p.animatable = field.animatable;
    return p;
}

}  // namespace sunder
