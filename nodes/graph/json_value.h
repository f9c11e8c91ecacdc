// One JSON value without the large header of its library: what descriptions of nodes are written with.
#pragma once

#include <initializer_list>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace sunder {

/// Keeps the order in which a file names things, so that what is read and written again looks the same.
using Json = nlohmann::ordered_json;

/// A whole number without a point: 12, 12.5.
Json number_json(double number);

/// Never changes, so that copies share it.
class JsonValue {
public:
    JsonValue() = default;  // null
    JsonValue(std::nullptr_t) {}
    JsonValue(bool value);
    JsonValue(int value);
    JsonValue(double value);
    JsonValue(const char* value);
    JsonValue(const std::string& value);
    JsonValue(std::initializer_list<double> values);
    JsonValue(std::initializer_list<int> values);
    JsonValue(Json value);

    static JsonValue empty_list();
    static JsonValue empty_object();

    const Json& get() const;
    operator const Json&() const { return get(); }
    std::string text() const;  // a text as it is, all else as in files

private:
    std::shared_ptr<const Json> json_;  // null: JSON's null
};

}  // namespace sunder
