#include "nodes/graph/description.h"

#include <algorithm>
#include <array>

#include "nodes/graph/json.h"

namespace sunder {

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
                                  "output_path", "vector3", "integer3", "vertex_groups", "points"};
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
