#include "nodes/graph/parameter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nodes/files/output_pattern.h"
#include "nodes/graph/nearest_name.h"
#include "nodes/graph/node.h"

namespace sunder {
namespace {

std::string_view expected_text(ParameterType type) {
    switch (type) {
        case ParameterType::boolean:
            return "true or false";
        case ParameterType::integer:
            return "a whole number";
        case ParameterType::number:
            return "a number";
        case ParameterType::text:
            return "a text";
        case ParameterType::choice:
            return "one of its choices, as a text";
        case ParameterType::path:
            return "a path, as a text";
        case ParameterType::output_path:
            return "a path with #### for the frame, as a text";
        case ParameterType::vector3:
            return "three numbers [x, y, z]";
        case ParameterType::integer3:
            return "three whole numbers [i, j, k]";
        case ParameterType::vertex_groups:
            return "an object {\"name\": [vertex, ...]}";
        case ParameterType::points:
            return "a list of points [[x, y, z], ...]";
        case ParameterType::vectors:
            return "a list of vectors [[x, y, z], ...]";
    }
    return "";
}

/// A value as an error message shows it: JSON, cut short.
std::string shown(const Json& value) {
    const std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    return text.size() <= 60 ? text : text.substr(0, 57) + "...";
}

/// Checks one value against one description.
class Checker {
public:
    Checker(const ParameterDescription& description, const std::string& node)
        : description_(description), node_(node) {}

    Error error(std::string what, std::string mend = {}) const {
        return node_error(node_, description_.name, std::move(what), std::move(mend));
    }

    Error wrong_type(const Json& value) const {
        std::string what = "takes " + std::string(expected_text(description_.type)) + ", not " + shown(value);
        std::string mend;
        if (description_.nullable) mend = "or null";
        if (description_.automatic) mend = "or \"auto\"";
        if (value.is_object() && value.contains("keys") && !description_.animatable) mend = "it cannot be animated";
        if (value.is_string() && value.get_ref<const std::string&>().starts_with("@")) mend = "wires go to sockets";
        return error(std::move(what), std::move(mend));
    }

    Result<Json> single(const Json& value) const {
        if (value.is_null()) {
            if (description_.nullable) return Json(nullptr);
            return wrong_type(value);
        }
        if (description_.automatic && value == kAutomatic) return value;
        switch (description_.type) {
            case ParameterType::boolean:
                return value.is_boolean() ? Result<Json>(value) : wrong_type(value);
            case ParameterType::integer:
                return integer(value, value);
            case ParameterType::number:
                return number(value, value);
            case ParameterType::vector3:
                return triple(value, &Checker::number);
            case ParameterType::integer3:
                return triple(value, &Checker::integer);
            case ParameterType::vertex_groups:
                return vertex_groups(value);
            case ParameterType::points:
            case ParameterType::vectors:
                return points(value);
            default:
                return text(value);
        }
    }

private:
    using Component = Result<Json> (Checker::*)(const Json& component, const Json& whole) const;

    Status in_range(double number) const {
        const bool above = !description_.min || number > *description_.min ||
                           (number == *description_.min && !description_.min_excluded);
        const bool below = !description_.max || number < *description_.max ||
                           (number == *description_.max && !description_.max_excluded);
        if (above && below) return {};
        const std::string unit = description_.unit.empty() ? "" : " " + description_.unit;
        return error(shown(number) + unit + " is out of range", "permitted: " + range_text(description_));
    }

    Result<Json> number(const Json& component, const Json& whole) const {
        if (!component.is_number()) return wrong_type(whole);
        const double number = component.get<double>();
        if (!std::isfinite(number)) return error("a number is not finite");
        if (Status ok = in_range(number); !ok) return ok.error();
        return Json(number);
    }

    Result<Json> integer(const Json& component, const Json& whole) const {
        if (!component.is_number()) return wrong_type(whole);
        const double number = component.get<double>();
        if (!(std::trunc(number) == number)) return wrong_type(whole);
        if (Status ok = in_range(number); !ok) return ok.error();
        if (constexpr int32_t most = std::numeric_limits<int32_t>::max(); std::abs(number) > most)
            return error(shown(component) + " is out of range",
                         "permitted: whole numbers up to " + std::to_string(most));
        const Json result(static_cast<int64_t>(number));
        if (!description_.choices.empty() &&
            std::ranges::find(description_.choices, result, &JsonValue::get) == description_.choices.end())
            return error(shown(result) + " is not one of its choices", "permitted: " + list_text(choice_texts()));
        return result;
    }

    Result<Json> triple(const Json& value, Component component) const {
        if (!value.is_array() || value.size() != 3) return wrong_type(value);
        Json result = Json::array();
        for (const Json& c : value) {
            Result<Json> checked = (this->*component)(c, value);
            if (!checked) return checked;
            result.push_back(checked.take());
        }
        return result;
    }

    Result<Json> points(const Json& value) const {
        if (!value.is_array()) return wrong_type(value);
        Json result = Json::array();
        for (const Json& point : value) {
            Result<Json> checked = triple(point, &Checker::number);
            if (!checked) return checked;
            result.push_back(checked.take());
        }
        return result;
    }

    Result<Json> text(const Json& value) const {
        for (const auto& [former, choice] : description_.former_values)
            if (value == former.get()) return choice.get();
        if (!value.is_string()) return wrong_type(value);
        const std::string& text = value.get_ref<const std::string&>();
        if (std::ranges::any_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
            return error("contains a control character");
        if (description_.type == ParameterType::choice &&
            std::ranges::find(description_.choices, value, &JsonValue::get) == description_.choices.end())
            return error("'" + text + "' is not one of its choices", permitted_text(text, choice_texts()));
        if (description_.type == ParameterType::output_path)
            if (Status ok = check_output_pattern(text); !ok) return error(ok.error().what, ok.error().mend);
        return value;
    }

    Result<Json> vertex_groups(const Json& value) const {
        if (!value.is_object()) return wrong_type(value);
        Json result = Json::object();
        for (const auto& [name, vertices] : value.items()) {
            if (!vertices.is_array()) return wrong_type(value);
            Json checked = Json::array();
            for (const Json& v : vertices) {
                if (!v.is_number_integer() || v.get<int64_t>() < 0 ||
                    v.get<int64_t>() > std::numeric_limits<int32_t>::max())
                    return error("group '" + name + "' has " + shown(v) + ", which is no vertex index");
                checked.push_back(v.get<int64_t>());
            }
            result.emplace(name, std::move(checked));
        }
        return result;
    }

    std::vector<std::string> choice_texts() const {
        std::vector<std::string> texts;
        for (const JsonValue& c : description_.choices) texts.push_back(c.text());
        return texts;
    }

    const ParameterDescription& description_;
    const std::string& node_;
};

bool has_linear(ParameterType type) { return type == ParameterType::number || type == ParameterType::vector3; }

/// a + t (b - a) of numbers or of lists of numbers.
Json blend(const Json& a, const Json& b, double t) {
    if (!a.is_array()) return a.get<double>() + t * (b.get<double>() - a.get<double>());
    Json result = Json::array();
    for (size_t i = 0; i < a.size(); ++i) result.push_back(blend(a[i], b[i], t));
    return result;
}

}  // namespace

Result<ParameterValue> ParameterValue::check(const ParameterDescription& description, const Json& value,
                                             const std::string& node) {
    const Checker checker(description, node);
    ParameterValue result;
    const bool keyed = description.animatable && value.is_object();
    if (!keyed) {
        Result<Json> constant = checker.single(value);
        if (!constant) return constant.error();
        result.constant_ = constant.take();
        return result;
    }

    const std::string form =
        "animated values are {\"keys\": [[frame, value], ...], \"interpolation\": \"linear\" or \"step\"}";
    for (const auto& [name, unused] : value.items())
        if (name != "keys" && name != "interpolation")
            return checker.error("unknown name '" + name + "' in an animation", form);
    if (!value.contains("keys") || !value["keys"].is_array() || value["keys"].empty())
        return checker.error("an animation has at least one key", form);
    result.interpolation_ = has_linear(description.type) ? Interpolation::linear : Interpolation::step;
    if (value.contains("interpolation")) {
        const Json& mode = value["interpolation"];
        if (mode != "linear" && mode != "step")
            return checker.error("unknown interpolation " + shown(mode), "permitted: linear, step");
        if (mode == "linear" && !has_linear(description.type))
            return checker.error("can only be animated in steps", form);
        result.interpolation_ = mode == "linear" ? Interpolation::linear : Interpolation::step;
    }
    for (const Json& key : value["keys"]) {
        if (!key.is_array() || key.size() != 2 || !key[0].is_number() || !std::isfinite(key[0].get<double>()))
            return checker.error(shown(key) + " is no key", form);
        const double frame = key[0].get<double>();
        if (!result.keys_.empty() && !(frame > result.keys_.back().frame))
            return checker.error("keys are not in ascending order at frame " + shown(key[0]),
                                 "sort them; one key a frame");
        Result<Json> checked = checker.single(key[1]);
        if (!checked) return checked.error();
        const bool may_blend = !checked->is_null() && !(description.automatic && *checked == kAutomatic);
        if (!may_blend && result.interpolation_ == Interpolation::linear)
            return checker.error(shown(*checked) + " cannot be blended at frame " + shown(key[0]),
                                 "use interpolation step");
        result.keys_.push_back({frame, checked.take()});
    }
    return result;
}

Json ParameterValue::at(double frame) const {
    if (keys_.empty()) return constant_;
    const auto after = std::ranges::upper_bound(keys_, frame, {}, &Key::frame);
    if (after == keys_.begin()) return keys_.front().value;
    const Key& a = *(after - 1);
    if (after == keys_.end() || interpolation_ == Interpolation::step) return a.value;
    return blend(a.value, after->value, (frame - a.frame) / (after->frame - a.frame));
}

double ParameterValue::integral(double from, double to) const {
    if (keys_.empty()) return constant_.get<double>() * (to - from);
    const auto value = [&](double frame) { return at(frame).get<double>(); };
    double sum = 0, begin = from;
    for (auto next = std::ranges::upper_bound(keys_, from, {}, &Key::frame); begin < to; ++next) {
        const bool is_last = next == keys_.end();
        const double end = is_last ? to : std::min(to, next->frame);
        const bool is_flat = is_last || next == keys_.begin() || interpolation_ == Interpolation::step;
        sum += (is_flat ? value(begin) : 0.5 * (value(begin) + value(end))) * (end - begin);
        begin = end;
        if (is_last) break;
    }
    return sum;
}

double ParameterValue::slope(double frame) const {
    const auto after = std::ranges::upper_bound(keys_, frame, {}, &Key::frame);
    if (interpolation_ == Interpolation::step || after == keys_.begin() || after == keys_.end()) return 0;
    const Key& a = *(after - 1);
    return (after->value.get<double>() - a.value.get<double>()) / (after->frame - a.frame);
}

Json ParameterValue::to_json() const {
    if (keys_.empty()) return constant_;
    Json keys = Json::array();
    for (const Key& key : keys_) keys.push_back(Json::array({number_json(key.frame), key.value}));
    return {{"keys", keys}, {"interpolation", interpolation_ == Interpolation::linear ? "linear" : "step"}};
}

}  // namespace sunder
