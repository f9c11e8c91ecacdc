#include <cmath>
#include <cstdint>

#include "nodes/graph/json.h"

namespace sunder {

Json number_json(double number) {
    const bool is_whole = number == std::trunc(number) && std::abs(number) < 1e15;
    return is_whole ? Json(static_cast<int64_t>(number)) : Json(number);
}

JsonValue::JsonValue(bool value) : JsonValue(Json(value)) {}
JsonValue::JsonValue(int value) : JsonValue(Json(value)) {}
JsonValue::JsonValue(double value) : JsonValue(Json(value)) {}
JsonValue::JsonValue(const char* value) : JsonValue(Json(value)) {}
JsonValue::JsonValue(const std::string& value) : JsonValue(Json(value)) {}
JsonValue::JsonValue(std::initializer_list<double> values) : JsonValue(Json(std::vector<double>(values))) {}
JsonValue::JsonValue(std::initializer_list<int> values) : JsonValue(Json(std::vector<int>(values))) {}
JsonValue::JsonValue(Json value) : json_(std::make_shared<const Json>(std::move(value))) {}

JsonValue JsonValue::empty_list() { return Json::array(); }
JsonValue JsonValue::empty_object() { return Json::object(); }

const Json& JsonValue::get() const {
    static const Json null;
    return json_ ? *json_ : null;
}

std::string JsonValue::text() const { return get().is_string() ? get().get<std::string>() : get().dump(); }

}  // namespace sunder
