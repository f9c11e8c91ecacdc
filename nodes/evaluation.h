// One evaluation of a graph: content keys, what is still cached, and cooking of what is not.
#pragma once

#include <set>
#include <unordered_map>

#include "nodes/graph_impl.h"

namespace sunder {

/// Keys are remembered for the time of one evaluation: nobody edits the graph meanwhile, and files are looked at once.
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
    Result<Value> evaluate(GraphNode& node, size_t output, int frame, const Progress& progress);
    Status seed(GraphNode& node, int frame, FrameState state, const Progress& progress);

    GraphImpl& graph() { return graph_; }

private:
    GraphImpl& graph_;
    std::unordered_map<const GraphNode*, ContentKey> keys_;
    std::unordered_map<const GraphNode*, bool> frame_dependence_;
    std::set<const GraphNode*> checked_;
};

}  // namespace sunder
