#include "nodes/graph/cook_groups.h"

#include <algorithm>
#include <map>
#include <tuple>

namespace sunder {
namespace {

class Walk {
public:
    Walk(Evaluation& evaluation, double frame) : evaluation_(evaluation), frame_(frame) {}

    /// How many nodes that cook together lie one behind the other up to this one.
    size_t visit(const WantedValue& wanted) {
        if (const auto known = depth_.find({wanted.node, wanted.output}); known != depth_.end()) return known->second;
        size_t depth = 0;
        const NodeType& type = *wanted.node->type;
        if (!evaluation_.find(*wanted.node, wanted.output, frame_)) {
            for (const auto& socket : wanted.node->inputs)
                for (const Wire& wire : socket) depth = std::max(depth, visit({wire.source, wire.output}));
            if (type.cook_together) groups_[{++depth, &type, wanted.output}].push_back(wanted);
        }
        return depth_[{wanted.node, wanted.output}] = depth;
    }

    std::vector<std::vector<WantedValue>> take() {
        std::vector<std::vector<WantedValue>> groups;
        for (auto& [key, group] : groups_)
            if (group.size() > 1) groups.push_back(std::move(group));
        return groups;
    }

private:
    Evaluation& evaluation_;
    const double frame_;
    std::map<std::pair<const GraphNode*, size_t>, size_t> depth_;
    // Types lie in one array, the registry's: their addresses are in its order.
    std::map<std::tuple<size_t, const NodeType*, size_t>, std::vector<WantedValue>> groups_;
};

}  // namespace

std::vector<std::vector<WantedValue>> cook_groups(Evaluation& evaluation, std::span<const WantedValue> wanted,
                                                  double frame) {
    Walk walk(evaluation, frame);
    for (const WantedValue& w : wanted) walk.visit(w);
    return walk.take();
}

}  // namespace sunder
