#include "nodes/evaluation.h"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <fstream>
#include <new>
#include <optional>

#include "nodes/nearest_name.h"

namespace sunder {
namespace {

constexpr size_t kCachedFrames = 2;  // values a node keeps if they differ by frame; solvers keep more in their store
constexpr double kInputShare = 0.3;  // of a node's progress that goes to what feeds it

class NodeContext : public CookContext {
public:
    NodeContext(Evaluation& evaluation, GraphNode& node, size_t output, int frame, const Progress& progress)
        : evaluation_(evaluation), node_(node), output_(output), frame_(frame), whole_(progress) {
        for (const auto& socket : node.inputs) n_wires_ += socket.size();
        own_ = n_wires_ ? progress.part(kInputShare, 1) : progress;
    }

    const std::string& node() const override { return node_.name; }
    std::string_view output() const override { return node_.description().outputs[output_].name; }
    int frame() const override { return frame_; }
    int start_frame() const override { return graph().frame_range[0]; }
    double frame_rate() const override { return graph().frame_rate; }
    int threads() const override { return graph().threads; }
    const WorkerPool& workers() override { return evaluation_.graph().workers(); }
    size_t cache_limit() const override { return graph().cache_limit; }
    std::string resolve(const std::string& path) const override { return graph().resolve(path); }
    const Progress& progress() const override { return own_; }
    NodeStore& store() override { return node_.store; }
    ContentKey key() override { return evaluation_.key(node_); }
    ContentKey input_key(std::string_view socket) override { return evaluation_.socket_key(node_, index_of(socket)); }

    const Parameters& parameters(int frame) override { return parameters_.emplace(node_, frame); }

    Result<std::vector<Value>> inputs(std::string_view socket, int frame) override {
        const size_t index = index_of(socket);
        size_t before = 0;
        for (size_t i = 0; i < index; ++i) before += node_.inputs[i].size();
        std::vector<Value> values;
        for (const Wire& wire : node_.inputs[index]) {
            const double share = kInputShare / static_cast<double>(n_wires_);
            const double begin = share * static_cast<double>(before + values.size());
            Result<Value> value =
                evaluation_.evaluate(*wire.source, wire.output, frame, whole_.part(begin, begin + share));
            if (!value) return value.error();
            values.push_back(value.take());
        }
        return values;
    }

private:
    const GraphImpl& graph() const { return evaluation_.graph(); }
    size_t index_of(std::string_view socket) const {
        const SocketDescription* const found = node_.description().find_input(socket);
        assert(found && "a node reads an input that it does not describe");
        return index_in(node_.description().inputs, found);
    }

    Evaluation& evaluation_;
    GraphNode& node_;
    size_t output_;
    int frame_;
    Progress whole_, own_;
    size_t n_wires_ = 0;
    std::optional<ParametersAt> parameters_;
};

/// Runs a node's function at the edge: exceptions of libraries become errors, and every error names the node.
template <class T, class Function>
Result<T> at_edge(const std::string& node, Function&& function) {
    Error error;
    try {
        Result<T> result = function();
        if (result || result.error().code == ErrorCode::cancelled || !result.error().node.empty()) return result;
        error = result.error();
    } catch (const std::bad_alloc&) {
        error = {ErrorCode::internal, "out of memory", {}, "fewer pieces or frames need less", {}, {}};
    } catch (const std::exception& e) {
        error = {ErrorCode::internal, std::string("unexpected: ") + e.what(), {}, {}, {}, {}};
    }
    const std::string place = "node '" + node + "'";
    if (!error.where.starts_with(place)) error.where = error.where.empty() ? place : place + ": " + error.where;
    error.node = node;
    return error;
}

}  // namespace

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
        hasher.add(p.name).add(value.dump());
        if (p.type == ParameterType::path && value.is_string())
            hasher.add(graph_.file_keys.key(graph_.resolve(value.get<std::string>())));
    }
    if (node.type->depends_on_frame) hasher.add(graph_.frame_range[0]).add(graph_.frame_rate);
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

Status Evaluation::check_upstream(const GraphNode& node) {
    if (!checked_.insert(&node).second) return {};
    for (const auto& socket : node.inputs)
        for (const Wire& wire : socket)
            if (Status ok = check_upstream(*wire.source); !ok) return ok;
    return check_node(node, graph_.frame_range[0]);
}

Result<Value> Evaluation::evaluate(GraphNode& node, size_t output, int frame, const Progress& progress) {
    const ContentKey wanted = key(node);
    const bool by_frame = depends_on_frame(node);
    const int slot = by_frame ? frame : 0;
    const auto known = std::ranges::find_if(
        node.cache, [&](const CachedValue& c) { return c.key == wanted && c.frame == slot && c.output == output; });
    if (known != node.cache.end()) return known->value;

    NodeContext context(*this, node, output, frame, progress);
    ++node.cook_count;
    const CutFolder kept = node.type->is_cut && !by_frame ? graph_.cuts : CutFolder();
    Result<Value> value = at_edge<Value>(node.name, [&]() -> Result<Value> {
        if (!kept) return node.type->cook(context);
        if (auto cut = kept.read(node.name, wanted)) return make_value(std::move(*cut));
        Result<Value> made = node.type->cook(context);
        if (made) kept.write(node.name, wanted, *std::get<std::shared_ptr<const FragmentSet>>(*made));
        return made;
    });
    if (!value) return value;
    assert(type_of(*value) == node.description().outputs[output].type && "a node gave another type than it describes");

    // What was cooked from other content will not be asked for again.
    std::erase_if(node.cache, [&](const CachedValue& c) { return c.key != wanted; });
    const size_t capacity = node.description().outputs.size() * (by_frame ? kCachedFrames : 1);
    node.cache.insert(node.cache.begin(), {wanted, slot, output, *value});
    if (node.cache.size() > capacity) node.cache.pop_back();
    return value;
}

Status Evaluation::seed(GraphNode& node, int frame, FrameState state, const Progress& progress) {
    if (!node.type->seed) return node_error(node.name, "", "takes no saved state", "only solver nodes do");
    NodeContext context(*this, node, 0, frame, progress);
    return at_edge<void>(node.name, [&] { return node.type->seed(context, frame, std::move(state)); });
}

Result<Value> Graph::evaluate(const std::string& name, const std::string& socket, int frame, const Progress& progress) {
    Result<GraphNode*> node = impl_->find(name);
    if (!node) return node.error();
    const std::vector<SocketDescription>& outputs = (*node)->description().outputs;
    const SocketDescription* const output = (*node)->description().find_output(socket);
    if (!output) {
        std::vector<std::string> permitted;
        for (const SocketDescription& s : outputs) permitted.push_back(s.name);
        return node_error(name, socket,
                          "a node of type " + (*node)->description().type + " has no output '" + socket + "'",
                          permitted_text(socket, permitted));
    }
    if (std::abs(static_cast<int64_t>(frame)) > kFarthestFrame)
        return bad_input("frame " + std::to_string(frame), "is out of range", "permitted: -1000000 to 1000000");
    Evaluation evaluation(*impl_);
    if (Status ok = evaluation.check_upstream(**node); !ok) return ok.error();
    return evaluation.evaluate(**node, index_in(outputs, output), frame, progress);
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

Status Graph::seed_state(const std::string& name, int frame, FrameState state, const Progress& progress) {
    Result<GraphNode*> node = impl_->find(name);
    if (!node) return node.error();
    Evaluation evaluation(*impl_);
    if (Status ok = evaluation.check_upstream(**node); !ok) return ok;
    return evaluation.seed(**node, frame, std::move(state), progress);
}

}  // namespace sunder
