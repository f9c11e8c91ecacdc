// docs/nodes.md: written from the descriptions, so that it cannot go stale.
#include <array>

#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"

namespace sunder {
namespace {

constexpr std::array<std::pair<const char*, const char*>, 4> kCategories = {
    {{"input", "Input"}, {"fracture", "Fracture"}, {"simulation", "Simulation"}, {"output", "Output"}}};

/// Text in a table cell.
std::string cell(std::string_view text) {
    std::string escaped;
    for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
    return escaped;
}

std::string code(std::string_view text) { return "`" + std::string(text) + "`"; }

std::string permitted(const ParameterDescription& p) {
    std::string text = range_text(p);
    for (const JsonValue& choice : p.choices) text += (text.empty() ? "" : ", ") + code(choice.text());
    return text;
}

std::string socket_rows(const NodeDescription& node) {
    std::string text;
    if (!node.inputs.empty()) text += "| input | takes | |\n|---|---|---|\n";
    for (const SocketDescription& s : node.inputs)
        text += "| " + code(s.name) + " | " + (s.many ? "a list of " : "") + code(name_of(s.type)) +
                (s.required ? "" : ", optional") + " | " + cell(s.sentence) + ". |\n";
    text += std::string(node.inputs.empty() ? "" : "\n") + "| output | gives | |\n|---|---|---|\n";
    for (const SocketDescription& s : node.outputs)
        text += "| " + code(s.name) + " | " + code(name_of(s.type)) + " | " + cell(s.sentence) + ". |\n";
    return text;
}

std::string parameter_row(const ParameterDescription& p) {
    std::string type(name_of(p.type));
    if (p.nullable) type += " or null";
    if (p.automatic) type += " or " + code(Json(kAutomatic).dump());
    if (p.animatable) type += ", animatable";
    std::string sentence = p.sentence + ".";
    if (!p.needs.empty()) sentence += " Needs " + needs_text(p, "`") + ".";
    for (const std::string& alias : p.aliases) sentence += " Formerly " + code(alias) + ".";
    for (const FormerDefault& former : p.former_defaults)
        sentence += " Left out in a graph of version " + std::to_string(former.last_version) + ": " +
                    code(former.value.get().dump()) + ".";
    for (const auto& [former, choice] : p.former_values)
        sentence += " Formerly " + code(former.text()) + " for " + code(choice.text()) + ".";
    return "| " + code(p.name) + " | " + p.label + " | " + type + " | " + cell(p.unit) + " | " +
           code(p.default_value.get().dump()) + " | " + cell(permitted(p)) + " | " + cell(sentence) + " |\n";
}

std::string section(const NodeDescription& node) {
    std::string text =
        "### " + node.label + ": " + code(node.type) + "\n\n" + node.sentence + "\n\n" + socket_rows(node) + "\n";
    if (node.parameters.empty()) return text;
    for (const ParameterGroup& group : node.groups()) {
        if (!group.label.empty()) text += "**" + group.label + "**\n\n";
        text += "| parameter | label | type | unit | default | permitted | |\n|---|---|---|---|---|---|---|\n";
        for (const ParameterDescription* p : group.parameters) text += parameter_row(*p);
        text += "\n";
    }
    return text;
}

}  // namespace

std::string node_reference_markdown(const Registry& registry) {
    std::string text =
        "# Nodes\n\n"
        "Written by `sunder nodes --markdown` from the descriptions that check graph files, fill the CLI's lists and "
        "draw the "
        "plug-in's panels.\n\n"
        "A wire is written `\"@node.socket\"`, a list of wires `[\"@a.body\", \"@b.body\"]`. An animatable parameter "
        "may be "
        "`{\"keys\": [[frame, value], ...], \"interpolation\": \"linear\"}` (or `\"step\"`): it holds its first and "
        "last value outside its "
        "keys. Where a parameter *needs* another to be so, it has no effect otherwise. Null is written `null`. Lengths "
        "are metres, z is up. A graph file begins with its version, "
        "`\"sunder\": " +
        std::to_string(kLatestGraphVersion) + "`; what a graph of an older one leaves out is what it was then.\n\n";
    for (const auto& [category, title] : kCategories) {
        text += "## " + std::string(title) + "\n\n";
        for (const NodeType& type : registry.types())
            if (type.description.category == category) text += section(type.description);
    }
    while (text.ends_with("\n\n")) text.pop_back();
    return text;
}

}  // namespace sunder
