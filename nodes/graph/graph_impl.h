// What a graph holds; shared by the files that edit it, evaluate it, and read and write it.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "nodes/files/cut_file.h"
#include "nodes/graph/graph.h"
#include "nodes/graph/parameter.h"
#include "solver/threads/parallel.h"

namespace sunder {

struct GraphNode;

constexpr int kFarthestFrame = 1'000'000;  // far beyond any shot; keeps differences of frames within an int

/// What feeds an input: an output of another node.
struct Wire {
    GraphNode* source;
    size_t output;  // index into the source's outputs
    bool operator==(const Wire&) const = default;
};

struct CachedValue {
    ContentKey key;
    double frame;  // 0 where the value is the same at all frames
    size_t output;
    Value value;
};

struct GraphNode {
    std::string name;
    int graph_version = kLatestGraphVersion;
    const NodeType* type;
    std::map<std::string, ParameterValue> given;  // parameters that are not left at their default
    std::vector<std::vector<Wire>> inputs;        // for each input socket of the description
    NodeStore store;
    std::vector<CachedValue> cache;  // newest first
    size_t cook_count = 0;

    const NodeDescription& description() const { return type->description; }
    /// The parameter as given, or its default.
    ParameterValue value(const ParameterDescription& parameter) const;
};

/// Content hashes of input files, kept while size and time of change stay.
class FileKeys {
public:
    ContentKey key(const std::string& path);

private:
    struct Entry {
        uint64_t size;
        int64_t changed;
        ContentKey key;
    };
    std::map<std::string, Entry> entries_;
};

struct GraphImpl {
    const Registry* registry;
    std::vector<std::unique_ptr<GraphNode>> nodes;  // in the order in which they were added
    std::map<std::string, GraphNode*, std::less<>> by_name;
    int version = kLatestGraphVersion;
    FrameRate frame_rate;
    std::array<int, 2> frame_range = {1, 96};
    int threads = 0;
    std::string base_folder;
    size_t cache_limit = size_t{1} << 30;
    CutFolder cuts;
    mutable FileKeys file_keys;

    /// Made when a node first asks for it.
    std::shared_ptr<const WorkerPool> workers() {
        if (!pool || pool_threads != threads) pool = std::make_shared<const WorkerPool>(pool_threads = threads);
        return pool;
    }
    std::shared_ptr<const WorkerPool> pool;
    int pool_threads = 0;

    Result<GraphNode*> find(std::string_view name) const;
    std::string resolve(const std::string& path) const;  // an input path, seen from the base folder
    /// The wire that `reference` names, if it fits input `socket` of `node` and closes no cycle.
    Result<Wire> wire(const SocketReference& reference, const GraphNode& node, const SocketDescription& socket) const;
    std::vector<std::string> names() const;
};

/// The index of a socket or parameter in its list.
template <class T>
size_t index_in(const std::vector<T>& list, const T* element) {
    return static_cast<size_t>(element - list.data());
}

/// Parameters of a node at a frame.
class ParametersAt : public Parameters {
public:
    ParametersAt(const GraphNode& node, double frame) : node_(&node), frame_(frame) {}
    Json value(std::string_view name) const override;

private:
    const GraphNode* node_;
    double frame_;
};

/// Required sockets wired, parameters in agreement with one another at the frame.
Status check_node(const GraphNode& node, double frame);

}  // namespace sunder
