#include "nodes/graph/graph.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "nodes/graph/graph_impl.h"
#include "nodes/graph/json.h"
#include "nodes/graph/nearest_name.h"
#include "solver/data/invariant.h"

namespace sunder {
namespace {

/// Names stand in "@node.socket", "NODE.PARAM=VALUE" and file names of reports.
Status check_node_name(const std::string& name) {
    constexpr size_t kLongest = 200;
    const bool bad =
        name.empty() || name.size() > kLongest || std::ranges::any_of(name, [](unsigned char c) {
            return c < 0x20 || c == 0x7f || c == '@' || c == '=' || c == '/' || c == '\\' || c == '"' || c == '\'';
        });
    if (!bad && Json(name).dump(-1, ' ', false, Json::error_handler_t::ignore) == '"' + name + '"') return {};
    constexpr size_t kShown = 40;
    std::string shown = name.substr(0, kShown);
    while (name.size() > shown.size() && !shown.empty() && (name[shown.size()] & 0xc0) == 0x80)
        shown.pop_back();  // ends between characters
    return bad_input("graph",
                     "the node's name " + Json(shown).dump(-1, ' ', false, Json::error_handler_t::replace) +
                         (name.size() > shown.size() ? "..." : "") +
                         " is empty, too long or holds a character that is not permitted",
                     "1 to 200 characters of UTF-8 without @ = / \\ quotes and control characters");
}

std::vector<std::string> names_of(const auto& descriptions) {
    std::vector<std::string> names;
    for (const auto& d : descriptions) names.push_back(d.name);
    return names;
}

/// From `from` upstream to `target`: the names on the way, or nothing.
std::vector<std::string> upstream_path(const GraphNode& from, const GraphNode& target,
                                       std::set<const GraphNode*>& io_seen) {
    if (&from == &target) return {from.name};
    if (!io_seen.insert(&from).second) return {};
    for (const auto& socket : from.inputs)
        for (const Wire& wire : socket)
            if (std::vector<std::string> path = upstream_path(*wire.source, target, io_seen); !path.empty()) {
                path.push_back(from.name);
                return path;
            }
    return {};
}

Error unknown_parameter(const GraphNode& node, const std::string& name) {
    std::vector<std::string> permitted = names_of(node.description().inputs);
    for (const ParameterDescription& p : node.description().parameters) permitted.push_back(p.name);
    return node_error(node.name, name,
                      "a node of type " + node.description().type + " has no parameter or input of that name",
                      permitted_text(name, permitted));
}

Error unknown_socket(const GraphNode& node, const std::string& name, const std::vector<SocketDescription>& sockets,
                     const char* kind) {
    return node_error(node.name, name,
                      "a node of type " + node.description().type + " has no " + kind + " '" + name + "'",
                      permitted_text(name, names_of(sockets)));
}

Result<const ParameterDescription*> find_parameter(const GraphNode& node, const std::string& name) {
    const ParameterDescription* found = node.description().find_parameter(name);
    if (!found) return unknown_parameter(node, name);
    return found;
}

}  // namespace

Result<SocketReference> parse_reference(std::string_view text) {
    const std::string_view body = text.starts_with('@') ? text.substr(1) : text;
    const size_t dot = body.rfind('.');
    if (dot == std::string_view::npos || dot == 0 || dot + 1 == body.size())
        return bad_input("", "'" + std::string(text) + "' does not name a socket", "write @node.socket");
    return SocketReference{std::string(body.substr(0, dot)), std::string(body.substr(dot + 1))};
}

ParameterValue GraphNode::value(const ParameterDescription& parameter) const {
    const auto found = given.find(parameter.name);
    if (found != given.end()) return found->second;
    Result<ParameterValue> value = ParameterValue::check(parameter, parameter.default_of(graph_version), name);
    SUNDER_ASSERT(value && "a default value does not fit its own description");
    return value.take();
}

Json ParametersAt::value(std::string_view name) const {
    const ParameterDescription* const parameter = node_->description().find_parameter(name);
    SUNDER_ASSERT(parameter && "a node reads a parameter that it does not describe");
    return node_->value(*parameter).at(frame_);
}

Status check_node(const GraphNode& node, double frame) {
    const std::vector<SocketDescription>& inputs = node.description().inputs;
    for (size_t i = 0; i < inputs.size(); ++i)
        if (inputs[i].required && node.inputs[i].empty())
            return node_error(node.name, inputs[i].name, "nothing is wired to it",
                              "it takes a " + std::string(name_of(inputs[i].type)) + ", as \"@node." +
                                  std::string(name_of(inputs[i].type)) + "\"");
    if (node.type->check) return node.type->check(node.name, ParametersAt(node, frame));
    return {};
}

Result<GraphNode*> GraphImpl::find(std::string_view name) const {
    const auto found = by_name.find(name);
    if (found != by_name.end()) return found->second;
    const std::string text(name);
    return node_error(text, "", "there is no node of that name", permitted_text(name, names()));
}

std::vector<std::string> GraphImpl::names() const {
    std::vector<std::string> result;
    for (const auto& node : nodes) result.push_back(node->name);
    return result;
}

std::string GraphImpl::resolve(const std::string& path) const {
    return path.empty() ? path : (std::filesystem::path(base_folder) / path).string();
}

Result<Wire> GraphImpl::wire(const SocketReference& reference, const GraphNode& node,
                             const SocketDescription& socket) const {
    const auto found = by_name.find(reference.node);
    if (found == by_name.end())
        return node_error(node.name, socket.name, "there is no node '" + reference.node + "'",
                          permitted_text(reference.node, names()));
    GraphNode& source = *found->second;
    const std::vector<SocketDescription>& outputs = source.description().outputs;
    const SocketDescription* const output = source.description().find_output(reference.socket);
    if (!output)
        return node_error(node.name, socket.name,
                          "node '" + source.name + "' of type " + source.description().type + " has no output '" +
                              reference.socket + "'",
                          permitted_text(reference.socket, names_of(outputs)));
    if (output->type != socket.type) {
        std::vector<std::string> givers;
        for (const NodeType& type : registry->types())
            if (std::ranges::find(type.description.outputs, socket.type, &SocketDescription::type) !=
                type.description.outputs.end())
                givers.push_back(type.description.type);
        return node_error(node.name, socket.name,
                          "takes a " + std::string(name_of(socket.type)) + ", but '" + source.name + "." +
                              output->name + "' is a " + std::string(name_of(output->type)),
                          "node types that give one: " + list_text(givers));
    }
    std::set<const GraphNode*> seen;
    if (const std::vector<std::string> path = upstream_path(source, node, seen); !path.empty()) {
        std::string text;
        for (const std::string& name : path) text += name + " -> ";
        return node_error(node.name, socket.name, "the wires run in a cycle: " + text + node.name,
                          "remove one of them");
    }
    return Wire{&source, index_in(outputs, output)};
}

Graph::Graph(const Registry& registry) : impl_(std::make_unique<GraphImpl>()) { impl_->registry = &registry; }
Graph::~Graph() = default;
Graph::Graph(Graph&&) noexcept = default;
Graph& Graph::operator=(Graph&&) noexcept = default;

Status Graph::add_node(const std::string& name, const std::string& type) {
    if (Status ok = check_node_name(name); !ok) return ok;
    if (has_node(name)) return node_error(name, "", "a node of that name is there already");
    const NodeType* const found = impl_->registry->find(type);
    if (!found) {
        std::vector<std::string> permitted;
        for (const NodeType& t : impl_->registry->types()) permitted.push_back(t.description.type);
        return node_error(name, "type", "there is no node type '" + type + "'", permitted_text(type, permitted));
    }
    auto node = std::make_unique<GraphNode>();
    node->name = name;
    node->graph_version = impl_->version;
    node->type = found;
    node->inputs.resize(found->description.inputs.size());
    impl_->by_name[name] = node.get();
    impl_->nodes.push_back(std::move(node));
    return {};
}

Status Graph::remove_node(const std::string& name) {
    Result<GraphNode*> node = impl_->find(name);
    if (!node) return node.error();
    for (const auto& other : impl_->nodes)
        for (auto& socket : other->inputs)
            std::erase_if(socket, [&](const Wire& wire) { return wire.source == *node; });
    impl_->by_name.erase(name);
    std::erase_if(impl_->nodes, [&](const auto& n) { return n.get() == *node; });
    return {};
}

bool Graph::has_node(std::string_view name) const { return impl_->by_name.contains(name); }
std::vector<std::string> Graph::node_names() const { return impl_->names(); }

Result<const NodeDescription*> Graph::describe(const std::string& name) const {
    Result<GraphNode*> node = impl_->find(name);
    if (!node) return node.error();
    return &(*node)->description();
}

Status Graph::connect(const SocketReference& output, const SocketReference& input) {
    Result<GraphNode*> node = impl_->find(input.node);
    if (!node) return node.error();
    const NodeDescription& description = (*node)->description();
    const SocketDescription* const socket = description.find_input(input.socket);
    if (!socket) return unknown_socket(**node, input.socket, description.inputs, "input");
    Result<Wire> wire = impl_->wire(output, **node, *socket);
    if (!wire) return wire.error();
    std::vector<Wire>& wires = (*node)->inputs[index_in(description.inputs, socket)];
    if (!socket->many) wires.clear();
    if (std::ranges::find(wires, *wire) != wires.end())
        return node_error(input.node, input.socket,
                          "'" + output.node + "." + output.socket + "' is wired to it already");
    wires.push_back(*wire);
    return {};
}

Status Graph::disconnect(const SocketReference& input) {
    Result<GraphNode*> node = impl_->find(input.node);
    if (!node) return node.error();
    const std::vector<SocketDescription>& inputs = (*node)->description().inputs;
    const SocketDescription* const socket = (*node)->description().find_input(input.socket);
    if (!socket) return unknown_socket(**node, input.socket, inputs, "input");
    (*node)->inputs[index_in(inputs, socket)].clear();
    return {};
}

Result<std::vector<SocketReference>> Graph::wires(const SocketReference& input) const {
    Result<GraphNode*> node = impl_->find(input.node);
    if (!node) return node.error();
    const std::vector<SocketDescription>& inputs = (*node)->description().inputs;
    const SocketDescription* const socket = (*node)->description().find_input(input.socket);
    if (!socket) return unknown_socket(**node, input.socket, inputs, "input");
    std::vector<SocketReference> references;
    for (const Wire& wire : (*node)->inputs[index_in(inputs, socket)])
        references.push_back({wire.source->name, wire.source->description().outputs[wire.output].name});
    return references;
}

Status Graph::set(const std::string& name, const std::string& parameter, const Json& value) {
    Result<GraphNode*> found = impl_->find(name);
    if (!found) return found.error();
    GraphNode& node = **found;
    const SocketDescription* const socket = node.description().find_input(parameter);
    if (!socket) {
        Result<const ParameterDescription*> description = find_parameter(node, parameter);
        if (!description) return description.error();
        Result<ParameterValue> checked = ParameterValue::check(**description, value, name);
        if (!checked) return checked.error();
        node.given.insert_or_assign((*description)->name, checked.take());
        return {};
    }

    std::vector<Wire> wires;
    const Json list = value.is_null() ? Json::array() : value.is_array() && socket->many ? value : Json::array({value});
    for (const Json& entry : list) {
        const std::string text = entry.is_string() ? entry.get<std::string>() : "";
        Result<SocketReference> reference = parse_reference(text);
        if (!text.starts_with('@') || !reference)
            return node_error(name, parameter, std::string("takes ") + (socket->many ? "a list of wires" : "one wire"),
                              "written as \"@node." + std::string(name_of(socket->type)) + "\"");
        Result<Wire> wire = impl_->wire(*reference, node, *socket);
        if (!wire) return wire.error();
        if (std::ranges::find(wires, *wire) != wires.end())
            return node_error(name, parameter, "'" + text + "' stands in it twice");
        wires.push_back(*wire);
    }
    node.inputs[index_in(node.description().inputs, socket)] = std::move(wires);
    return {};
}

Status Graph::reset(const std::string& name, const std::string& parameter) {
    Result<GraphNode*> node = impl_->find(name);
    if (!node) return node.error();
    Result<const ParameterDescription*> description = find_parameter(**node, parameter);
    if (!description) return description.error();
    (*node)->given.erase((*description)->name);
    return {};
}

Result<Json> Graph::parameter(const std::string& name, const std::string& parameter) const {
    Result<GraphNode*> node = impl_->find(name);
    if (!node) return node.error();
    Result<const ParameterDescription*> description = find_parameter(**node, parameter);
    if (!description) return description.error();
    return (*node)->value(**description).to_json();
}

Result<Json> Graph::parameter_at(const std::string& name, const std::string& parameter, double frame) const {
    Result<GraphNode*> node = impl_->find(name);
    if (!node) return node.error();
    Result<const ParameterDescription*> description = find_parameter(**node, parameter);
    if (!description) return description.error();
    return (*node)->value(**description).at(frame);
}

Result<double> Graph::integral(const std::string& name, const std::string& parameter, double from, double to) const {
    Result<GraphNode*> node = impl_->find(name);
    if (!node) return node.error();
    Result<const ParameterDescription*> description = find_parameter(**node, parameter);
    if (!description) return description.error();
    return (*node)->value(**description).integral(from, to);
}

int Graph::version() const { return impl_->version; }
FrameRate Graph::frame_rate() const { return impl_->frame_rate; }
std::array<int, 2> Graph::frame_range() const { return impl_->frame_range; }
int Graph::threads() const { return impl_->threads; }
const std::string& Graph::base_folder() const { return impl_->base_folder; }
void Graph::set_base_folder(const std::string& folder) { impl_->base_folder = folder; }
void Graph::set_cut_folder(const std::string& folder) { impl_->cuts = CutFolder(folder); }
void Graph::set_cache_limit(size_t bytes) { impl_->cache_limit = bytes; }

Status Graph::set_frame_rate(double frames, double seconds) {
    const Result<FrameRate> rate = FrameRate::of(frames, seconds);
    if (!rate) return rate.error();
    impl_->frame_rate = *rate;
    return {};
}

Status Graph::set_frame_range(int first, int last) {
    const std::string range = "[" + std::to_string(first) + ", " + std::to_string(last) + "]";
    if (first > last) return bad_input("frame_range", range + " is reversed", "the first frame stands first");
    if (first < -kFarthestFrame || last > kFarthestFrame)
        return bad_input("frame_range", range + " is out of range", "permitted: -1000000 to 1000000");
    impl_->frame_range = {first, last};
    return {};
}

Status Graph::set_threads(int threads) {
    if (threads < 0 || threads > 1024)
        return bad_input("threads", "out of range", "permitted: 1 to 1024, or 0 for all cores");
    impl_->threads = threads;
    return {};
}

Status Graph::check() const {
    for (const auto& node : impl_->nodes)
        if (Status ok = check_node(*node, impl_->frame_range[0]); !ok) return ok;
    return {};
}

size_t Graph::cook_count(const std::string& name) const {
    Result<GraphNode*> node = impl_->find(name);
    return node ? (*node)->cook_count : 0;
}

}  // namespace sunder
