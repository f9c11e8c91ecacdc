// What a node is, as data: sockets and parameters with their types, units, ranges, defaults and one sentence each.
// JSON validation, the CLI's listing, the C ABI, Python, Blender's sockets and the node reference all read this.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/graph/json_value.h"

namespace sunder {

/// What runs through a wire. The order is that of the alternatives of Value (value.h).
enum class SocketType { mesh, fragments, body, rigid_body, collider, pin, force, state, visual_mesh, bake_item };

struct SocketDescription {
    std::string name = {};   // as in files and scripts, snake_case
    std::string label = {};  // as artists read it
    SocketType type = SocketType::mesh;
    bool many = false;          // takes a list of wires (inputs only)
    bool required = true;       // has to be wired before the node can be evaluated (inputs only)
    std::string sentence = {};  // what it is for
};

enum class ParameterType {
    boolean,
    integer,
    number,
    text,
    choice,         // one of `choices`
    path,           // of an input file, relative to the graph's folder
    output_path,    // pattern below the output folder, "####" being the frame
    vector3,        // [x, y, z]
    integer3,       // [i, j, k]
    vertex_groups,  // {"name": [vertex, ...], ...}
    points,         // [[x, y, z], ...]
    vectors,        // the same, as numbers of a field
};

/// What a parameter takes that may be automatic.
constexpr const char* kAutomatic = "auto";

/// What a parameter was left at before it got another default.
struct FormerDefault {
    int last_version;  // of graphs that have it
    JsonValue value;
};

/// What another parameter of the same node has to be: one of `values`, or above a number, or anything but null.
struct Condition {
    std::string parameter = {};
    std::vector<JsonValue> values = {};
    std::optional<double> above = {};
    bool not_null = false;
};
Condition is(std::string parameter, std::vector<JsonValue> values);
Condition is_above(std::string parameter, double bound);
Condition is_not_null(std::string parameter);

/// Alternatives, of one of which all conditions have to hold; none: nothing is needed.
using Needs = std::vector<std::vector<Condition>>;

struct ParameterDescription {
    std::string name = {};   // as in files and scripts, snake_case
    std::string label = {};  // as artists read it
    ParameterType type = ParameterType::number;
    std::string unit = {};                     // "m", "Pa", ...; empty: a pure number
    std::optional<double> min = {}, max = {};  // of each component
    bool min_excluded = false, max_excluded = false;
    JsonValue default_value = {};
    std::string sentence = {};  // what it does, limits that the range cannot tell
    bool animatable = false;    // may be {"keys": [[frame, value], ...], "interpolation": "linear"|"step"}
    bool nullable = false;      // may be null; the sentence says what that means
    bool automatic = false;     // may be "auto"; the sentence says what that means
    std::vector<FormerDefault> former_defaults = {};  // ascending by version
    std::vector<JsonValue> choices = {};              // permitted values of a choice (texts) or an integer (numbers)
    std::vector<std::string> aliases = {};            // names that it had before; files that use them still load
    /// Of a choice: what it took before, and which choice that is.
    std::vector<std::pair<JsonValue, JsonValue>> former_values = {};
    std::string group = {};  // as artists read it: what is folded together; empty: what is seen at once
    Needs needs = {};        // without which it has no effect, whatever it is

    /// In graphs of that version.
    const Json& default_of(int graph_version) const;
};

ParameterDescription in_group(std::string group, ParameterDescription parameter);
ParameterDescription needing(Needs needs, ParameterDescription parameter);
/// Those of the names go into a group.
void gather(std::vector<ParameterDescription>& io_parameters, const std::string& group,
            const std::vector<std::string>& names);
/// The one of that name, which has to be there.
ParameterDescription& at(std::vector<ParameterDescription>& io_parameters, std::string_view name);

struct ParameterGroup {
    std::string label = {};  // empty: of what is seen at once
    std::vector<const ParameterDescription*> parameters = {};
};

struct NodeDescription {
    std::string type = {};      // as in files, snake_case
    std::string label = {};     // as artists read it
    std::string category = {};  // "input", "fracture", "simulation", "output": where menus list it
    std::string sentence = {};  // what the node does
    std::vector<SocketDescription> inputs = {}, outputs = {};
    std::vector<ParameterDescription> parameters = {};

    const SocketDescription* find_input(std::string_view name) const;
    const SocketDescription* find_output(std::string_view name) const;
    /// By name or alias.
    const ParameterDescription* find_parameter(std::string_view name) const;
    /// What is seen at once, then group after group, as lists and panels show them.
    std::vector<ParameterGroup> groups() const;
};

std::string_view name_of(SocketType type);     // "rigid_body"
std::string_view name_of(ParameterType type);  // "vector3"

/// "0 < value <= 0.45", "value >= 0", or nothing: the range as a person writes it.
std::string range_text(const ParameterDescription& parameter);

/// "method = kmeans and source = tets", or nothing: what a parameter needs as a person writes it. `quote` goes around
/// names and values.
std::string needs_text(const ParameterDescription& parameter, const std::string& quote = "");

Json to_json(const NodeDescription& node);

}  // namespace sunder
