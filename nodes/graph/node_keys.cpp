// Content keys of nodes: what their values depend on, files included.
#include <filesystem>
#include <fstream>
#include <vector>

#include "nodes/graph/evaluation.h"
#include "nodes/graph/json.h"

namespace sunder {

ContentKey FileKeys::key(const std::string& path) {
    std::error_code fault;
    const uint64_t size = std::filesystem::file_size(path, fault);
    if (fault || !std::filesystem::is_regular_file(path, fault)) return 0;  // missing: the node that reads it says so
    const int64_t changed = std::filesystem::last_write_time(path, fault).time_since_epoch().count();
    const auto known = entries_.find(path);
    if (known != entries_.end() && known->second.size == size && known->second.changed == changed)
        return known->second.key;

    KeyHasher hasher;
    std::ifstream file(path, std::ios::binary);
    std::vector<char> block(1 << 20);
    while (file.read(block.data(), static_cast<std::streamsize>(block.size())), file.gcount() > 0)
        hasher.add(std::string_view(block.data(), static_cast<size_t>(file.gcount())));
    const ContentKey key = hasher.key();
    entries_[path] = {size, changed, key};
    return key;
}

ContentKey Evaluation::own_key(const GraphNode& node) {
    KeyHasher hasher;
    hasher.add(node.name).add(node.description().type);
    for (const ParameterDescription& p : node.description().parameters) {
        const Json value = node.value(p).to_json();
        hasher.add(p.name).add(value.dump(-1, ' ', false, Json::error_handler_t::replace));
        if (p.type == ParameterType::path && value.is_string())
            hasher.add(graph_.file_keys.key(graph_.resolve(value.get<std::string>())));
    }
    if (node.type->depends_on_frame) {
        hasher.add(graph_.frame_range[0]).add(graph_.frame_rate.numerator());
        if (graph_.frame_rate.is_ratio()) hasher.add(graph_.frame_rate.denominator());
    }
    return hasher.key();
}

ContentKey Evaluation::key(const GraphNode& node) {
    if (const auto known = keys_.find(&node); known != keys_.end()) return known->second;
    KeyHasher hasher;
    hasher.add(own_key(node));
    for (size_t i = 0; i < node.inputs.size(); ++i) hasher.add(socket_key(node, i));
    return keys_[&node] = hasher.key();
}

ContentKey Evaluation::socket_key(const GraphNode& node, size_t socket) {
    KeyHasher hasher;
    hasher.add(node.inputs[socket].size());
    for (const Wire& wire : node.inputs[socket]) hasher.add(key(*wire.source)).add(wire.output);
    return hasher.key();
}

bool Evaluation::depends_on_frame(const GraphNode& node) {
    if (const auto known = frame_dependence_.find(&node); known != frame_dependence_.end()) return known->second;
    bool depends = node.type->depends_on_frame;
    for (const auto& [name, value] : node.given) depends = depends || value.is_animated();
    for (const auto& socket : node.inputs)
        for (const Wire& wire : socket) depends = depends || depends_on_frame(*wire.source);
    return frame_dependence_[&node] = depends;
}

std::map<std::string, ContentKey> Graph::keys() const {
    Evaluation evaluation(*impl_);
    std::map<std::string, ContentKey> keys;
    for (const auto& node : impl_->nodes) keys[node->name] = evaluation.key(*node);
    return keys;
}

std::map<std::string, ContentKey> Graph::own_keys() const {
    Evaluation evaluation(*impl_);
    std::map<std::string, ContentKey> keys;
    for (const auto& node : impl_->nodes) keys[node->name] = evaluation.own_key(*node);
    return keys;
}

}  // namespace sunder
