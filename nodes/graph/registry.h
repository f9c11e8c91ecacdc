// The list of node types. A new node is one file and one line here.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/graph/node.h"

namespace sunder {

class Registry {
public:
    explicit Registry(std::vector<NodeType> types) : types_(std::move(types)) {}

    std::span<const NodeType> types() const { return types_; }
    const NodeType* find(std::string_view type) const;

private:
    std::vector<NodeType> types_;
};

/// All node types of Sunder, in the order in which menus and documents list them.
const Registry& standard_registry();

/// {"sunder": VERSION, "nodes": [...]}: what `sunder nodes --json` prints.
Json descriptions_to_json(const Registry& registry = standard_registry());

/// docs/nodes.md: every node with its sockets and parameters, as Markdown.
std::string node_reference_markdown(const Registry& registry = standard_registry());

}  // namespace sunder
