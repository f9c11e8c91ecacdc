#include "solver/data/fields.h"

#include <cstdio>

namespace sunder {
namespace {

std::string number(double v) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", v);
    return text;
}

}  // namespace

Status check_field(const FieldDescription& field, double value, const std::string& where) {
    const bool is_above = field.min_excluded ? value > field.min : value >= field.min;
    if (is_above && value <= field.max) return {};  // a NaN fails both
    Error e = bad_input(where, std::string(field.name) + " is " + number(value),
                        std::string("permitted: ") + (field.min_excluded ? "above " : "") + number(field.min) + " to " +
                            number(field.max));
    e.parameter = field.name;
    return e;
}

}  // namespace sunder
