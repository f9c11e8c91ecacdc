// The graph as JSON: reader and writer.
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "nodes/graph/graph.h"
#include "nodes/graph/graph_impl.h"
#include "nodes/graph/nearest_name.h"
#include "nodes/graph/strict_json.h"

namespace sunder {
namespace {

Result<int> read_version(const Json& json, const std::string& where) {
    const std::string latest = std::to_string(kLatestGraphVersion);
    if (!json.is_object() || !json.contains("sunder"))
        return bad_input(where, "not a graph of Sunder",
                         "a graph is an object {\"sunder\": " + latest + ", \"nodes\": {...}}");
    for (int version = kFirstGraphVersion; version <= kLatestGraphVersion; ++version)
        if (json["sunder"] == version) return version;
    return bad_input(where, "graph version " + json["sunder"].dump() + " is not known",
                     "this version of Sunder reads versions " + std::to_string(kFirstGraphVersion) + " to " + latest);
}

Status read_settings(const Json& json, const std::string& where, Graph& io_graph) {
    static const std::vector<std::string> kNames = {"sunder", "frame_rate", "frame_range", "nodes"};
    for (const auto& [name, unused] : json.items())
        if (std::ranges::find(kNames, name) == kNames.end())
            return bad_input(where, "a graph has no setting '" + name + "'", permitted_text(name, kNames));
    if (!json.contains("nodes") || !json["nodes"].is_object())
        return bad_input(where, "a graph has its nodes as an object", "\"nodes\": {\"name\": {\"type\": ...}}");
    if (json.contains("frame_rate")) {
        const Result<FrameRate> rate = FrameRate::read(json["frame_rate"]);
        if (!rate) return rate.error();
        if (Status ok = io_graph.set_frame_rate(rate->numerator(), rate->denominator()); !ok) return ok;
    }
    if (json.contains("frame_range")) {
        const Json& range = json["frame_range"];
        const auto is_frame = [](const Json& f) { return f.is_number_integer() && std::abs(f.get<double>()) < 1e9; };
        if (!range.is_array() || range.size() != 2 || !is_frame(range[0]) || !is_frame(range[1]))
            return bad_input("frame_range", "takes two whole numbers, not " + range.dump(), "[first, last]");
        if (Status ok = io_graph.set_frame_range(range[0].get<int>(), range[1].get<int>()); !ok) return ok;
    }
    return {};
}

Status add_nodes(const Json& nodes, Graph& io_graph) {
    for (const auto& [name, node] : nodes.items()) {
        if (!node.is_object())
            return node_error(name, "", "a node is an object", "{\"type\": ..., parameters and wires}");
        if (!node.contains("type")) return node_error(name, "type", "is missing", "every node has a type");
        if (!node["type"].is_string()) return node_error(name, "type", "takes a text, not " + node["type"].dump());
        if (Status ok = io_graph.add_node(name, node["type"].get<std::string>()); !ok) return ok;
    }
    return {};
}

/// After all nodes are there, since a wire may lead to a node further down.
Status set_parameters(const Json& nodes, Graph& io_graph) {
    for (const auto& [name, node] : nodes.items()) {
        const NodeDescription& description = **io_graph.describe(name);
        std::set<std::string> given;
        for (const auto& [key, value] : node.items()) {
            if (key == "type") continue;
            const ParameterDescription* const parameter = description.find_parameter(key);
            if (parameter && !given.insert(parameter->name).second)
                return node_error(name, key, "is given twice",
                                  "'" + key + "' is an older name of '" + parameter->name + "'");
            if (Status ok = io_graph.set(name, key, value); !ok) return ok;
        }
    }
    return {};
}

Json wires_to_json(const std::vector<Wire>& wires, bool many) {
    Json list = Json::array();
    for (const Wire& wire : wires)
        list.push_back("@" + wire.source->name + "." + wire.source->description().outputs[wire.output].name);
    return many ? list : list.front();
}

}  // namespace

Result<Graph> Graph::from_json_text(std::string_view text, const std::string& where, const std::string& base_folder,
                                    const Registry& registry) {
    Result<Json> json = parse_json(text, where);
    if (!json) return json.error();
    Graph graph(registry);
    const Result<int> version = read_version(*json, where);
    if (!version) return version.error();
    graph.impl_->version = *version;
    graph.set_base_folder(base_folder);
    if (Status ok = read_settings(*json, where, graph); !ok) return ok.error();
    if (Status ok = add_nodes((*json)["nodes"], graph); !ok) return ok.error();
    if (Status ok = set_parameters((*json)["nodes"], graph); !ok) return ok.error();
    if (Status ok = graph.check(); !ok) return ok.error();
    return graph;
}

Result<Graph> Graph::load(const std::string& path, const Registry& registry) {
    constexpr std::uintmax_t kLargest =
        256u << 20;  // bytes; a graph is written by people and exporters, not by the gigabyte
    std::error_code fault;
    if (!std::filesystem::exists(path, fault)) return bad_input(path, "there is no such file");
    if (!std::filesystem::is_regular_file(path, fault)) return bad_input(path, "is not a file");
    if (std::filesystem::file_size(path, fault) > kLargest)
        return bad_input(path, "is too large for a graph", "256 MiB at most");
    std::ifstream file(path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (!file.is_open() || file.bad()) return bad_input(path, std::string("cannot be read: ") + std::strerror(errno));
    return from_json_text(text, path, std::filesystem::path(path).parent_path().string(), registry);
}

Json Graph::to_json(Defaults defaults) const {
    Json json = {
        {"sunder", impl_->version}, {"frame_rate", impl_->frame_rate.to_json()}, {"frame_range", impl_->frame_range}};
    Json& nodes = json["nodes"] = Json::object();
    for (const auto& node : impl_->nodes) {
        const NodeDescription& description = node->description();
        Json entry = {{"type", description.type}};
        for (size_t i = 0; i < description.inputs.size(); ++i)
            if (!node->inputs[i].empty())
                entry[description.inputs[i].name] = wires_to_json(node->inputs[i], description.inputs[i].many);
        for (const ParameterDescription& p : description.parameters)
            if (defaults == Defaults::write || node->given.contains(p.name)) entry[p.name] = node->value(p).to_json();
        nodes[node->name] = std::move(entry);
    }
    return json;
}

}  // namespace sunder
