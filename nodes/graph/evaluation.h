// One evaluation of a graph: content keys, what is still cached, and cooking of what is not.
#pragma once

#include <map>
#include <span>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "nodes/graph/graph_impl.h"

namespace sunder {

/// An output of a node.
struct WantedValue {
    GraphNode* node;
    size_t output;
};

/// Keys and failures are remembered for the time of one evaluation: nobody edits the graph meanwhile, and files are
/// looked at once. Once cancelled, it cooks nothing any more.
class Evaluation {
public:
    explicit Evaluation(GraphImpl& graph) : graph_(graph) {}

    /// Of type, parameters and files of the node itself.
    ContentKey own_key(const GraphNode& node);
    /// The same with all that feeds it.
    ContentKey key(const GraphNode& node);
    ContentKey socket_key(const GraphNode& node, size_t socket);
    /// Whether its value may differ between frames.
    bool depends_on_frame(const GraphNode& node);

    /// All that the node needs is wired and in agreement.
    Status check_upstream(const GraphNode& node);
    Result<Value> evaluate(GraphNode& node, size_t output, double frame, const Progress& progress);
    /// Of each what `evaluate` gives, bit for bit; nodes that can be cooked together are.
    std::vector<Result<Value>> evaluate_all(std::span<const WantedValue> wanted, double frame,
                                            const Progress& progress);
    Status seed(GraphNode& node, int frame, FrameState state, const Progress& progress);

    /// The value that a node keeps, if it still holds; or else null.
    const Value* find(const GraphNode& node, size_t output, double frame);
    GraphImpl& graph() { return graph_; }

private:
    void cook_together(std::span<const WantedValue> group, double frame, const Progress& progress);
    Result<Value> keep(GraphNode& node, size_t output, double frame, Result<Value> value);
    /// The frame that a value of the node is kept under: 0 where all frames have the same.
    double slot(const GraphNode& node, double frame) { return depends_on_frame(node) ? frame : 0; }

    GraphImpl& graph_;
    std::unordered_map<const GraphNode*, ContentKey> keys_;
    std::unordered_map<const GraphNode*, bool> frame_dependence_;
    std::unordered_map<const GraphNode*, Status> checked_;
    std::map<std::tuple<const GraphNode*, size_t, double>, Error> failed_;  // by output and slot
    bool is_cancelled_ = false;
};

}  // namespace sunder
