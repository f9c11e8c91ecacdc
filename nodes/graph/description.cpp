#include "nodes/graph/description.h"

#include <algorithm>
#include <array>

#include "nodes/graph/json.h"
#include "solver/data/invariant.h"

namespace sunder {

Condition is(std::string parameter, std::vector<JsonValue> values) {
    return {.parameter = std::move(parameter), .values = std::move(values)};
}

Condition is_above(std::string parameter, double bound) { return {.parameter = std::move(parameter), .above = bound}; }

Condition is_not_null(std::string parameter) { return {.parameter = std::move(parameter), .not_null = true}; }

ParameterDescription in_group(std::string group, ParameterDescription parameter) {
    parameter.group = std::move(group);
    return parameter;
}

ParameterDescription needing(Needs needs, ParameterDescription parameter) {
    parameter.needs = std::move(needs);
    return parameter;
}

ParameterDescription& at(std::vector<ParameterDescription>& io_parameters, std::string_view name) {
    const auto found = std::ranges::find(io_parameters, name, &ParameterDescription::name);
    SUNDER_ASSERT(found != io_parameters.end());
    return *found;
}

void gather(std::vector<ParameterDescription>& io_parameters, const std::string& group,
            const std::vector<std::string>& names) {
    for (const std::string& name : names) at(io_parameters, name).group = group;
}

const SocketDescription* NodeDescription::find_input(std::string_view name) const {
    const auto found = std::ranges::find(inputs, name, &SocketDescription::name);
    return found == inputs.end() ? nullptr : &*found;
}

const SocketDescription* NodeDescription::find_output(std::string_view name) const {
    const auto found = std::ranges::find(outputs, name, &SocketDescription::name);
    return found == outputs.end() ? nullptr : &*found;
}

const ParameterDescription* NodeDescription::find_parameter(std::string_view name) const {
    const auto found = std::ranges::find_if(parameters, [&](const ParameterDescription& p) {
        return p.name == name || std::ranges::find(p.aliases, name) != p.aliases.end();
    });
    return found == parameters.end() ? nullptr : &*found;
}

std::vector<ParameterGroup> NodeDescription::groups() const {
    std::vector<ParameterGroup> groups(1);
    for (const ParameterDescription& p : parameters) {
        auto group = std::ranges::find(groups, p.group, &ParameterGroup::label);
        if (group == groups.end()) group = groups.insert(group, {.label = p.group});
        group->parameters.push_back(&p);
    }
    if (groups.front().parameters.empty()) groups.erase(groups.begin());
    return groups;
}

const Json& ParameterDescription::default_of(int graph_version) const {
    for (const FormerDefault& former : former_defaults)
        if (graph_version <= former.last_version) return former.value;
    return default_value;
}

std::string_view name_of(SocketType type) {
    constexpr std::array names = {"mesh", "fragments", "body",  "rigid_body",  "collider",
                                  "pin",  "force",     "state", "visual_mesh", "bake_item"};
    return names[static_cast<size_t>(type)];
}

std::string_view name_of(ParameterType type) {
    constexpr std::array names = {"boolean",     "integer", "number",   "text",          "choice", "path",
                                  "output_path", "vector3", "integer3", "vertex_groups", "points", "vectors"};
    return names[static_cast<size_t>(type)];
}

std::string range_text(const ParameterDescription& parameter) {
    const auto bound = [](double value) {
        char text[32];
        std::snprintf(text, sizeof text, "%.10g", value);
        return std::string(text);
    };
    const std::string above = parameter.min_excluded ? " < " : " <= ", below = parameter.max_excluded ? " < " : " <= ";
    if (parameter.min && parameter.max) return bound(*parameter.min) + above + "value" + below + bound(*parameter.max);
    if (parameter.min) return std::string("value") + (parameter.min_excluded ? " > " : " >= ") + bound(*parameter.min);
    if (parameter.max) return "value" + below + bound(*parameter.max);
    return "";
}

namespace {

// "kmeans", "impact or points", "kmeans, uniform or poisson"
std::string listed(const std::vector<JsonValue>& values, const std::string& quote) {
    std::string text;
    for (size_t i = 0; i < values.size(); ++i)
        text += (i == 0 ? "" : i + 1 == values.size() ? " or " : ", ") + quote + values[i].text() + quote;
    return text;
}

std::string text_of(const Condition& condition, const std::string& quote) {
    const std::string name = quote + condition.parameter + quote;
    if (condition.not_null) return name + " is not null";
    if (condition.above) return name + " > " + quote + JsonValue(Json(*condition.above)).text() + quote;
    return name + " = " + listed(condition.values, quote);
}

}  // namespace

std::string needs_text(const ParameterDescription& parameter, const std::string& quote) {
    std::string text;
    for (const std::vector<Condition>& alternative : parameter.needs) {
        text += text.empty() ? "" : ", or ";
        for (const Condition& condition : alternative)
            text += (&condition == &alternative.front() ? "" : " and ") + text_of(condition, quote);
    }
    return text;
}

namespace {

Json to_json(const Condition& condition) {
    Json json = {{"parameter", condition.parameter}};
    for (const JsonValue& value : condition.values) json["values"].push_back(value.get());
    if (condition.above) json["above"] = *condition.above;
    if (condition.not_null) json["not_null"] = true;
    return json;
}

Json to_json(const SocketDescription& socket, bool is_input) {
    Json json = {{"name", socket.name}, {"label", socket.label}, {"type", name_of(socket.type)}};
    if (is_input) {
        json["many"] = socket.many;
        json["required"] = socket.required;
    }
    json["sentence"] = socket.sentence;
    return json;
}

Json to_json(const ParameterDescription& p) {
    Json json = {{"name", p.name}, {"label", p.label}, {"type", name_of(p.type)}, {"unit", p.unit}};
    if (p.min) json[p.min_excluded ? "above" : "min"] = *p.min;
    if (p.max) json[p.max_excluded ? "below" : "max"] = *p.max;
    json["default"] = p.default_value.get();
    json["sentence"] = p.sentence;
    json["animatable"] = p.animatable;
    json["nullable"] = p.nullable;
    json["automatic"] = p.automatic;
    for (const FormerDefault& former : p.former_defaults)
        json["former_defaults"].push_back({{"last_version", former.last_version}, {"default", former.value.get()}});
    for (const JsonValue& choice : p.choices) json["choices"].push_back(choice.get());
    if (!p.aliases.empty()) json["aliases"] = p.aliases;
    json["group"] = p.group;
    if (p.needs.empty()) return json;
    for (const std::vector<Condition>& alternative : p.needs) {
        Json conditions = Json::array();
        for (const Condition& condition : alternative) conditions.push_back(to_json(condition));
        json["needs"].push_back(std::move(conditions));
    }
    json["needs_text"] = needs_text(p);
    return json;
}

}  // namespace

Json to_json(const NodeDescription& node) {
    Json json = {{"type", node.type}, {"label", node.label}, {"category", node.category}, {"sentence", node.sentence}};
    for (const char* list : {"inputs", "outputs", "parameters"}) json[list] = Json::array();
    for (const SocketDescription& s : node.inputs) json["inputs"].push_back(to_json(s, true));
    for (const SocketDescription& s : node.outputs) json["outputs"].push_back(to_json(s, false));
    for (const ParameterDescription& p : node.parameters) json["parameters"].push_back(to_json(p));
    return json;
}

}  // namespace sunder
