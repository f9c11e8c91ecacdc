// A registry of two small node types that carry a number through wires (as Force::drag): what the graph's own tests
// use, so that they need no solver and may build wires that Sunder's own types do not allow, such as cycles.
#pragma once

#include "nodes/graph/graph.h"
#include "nodes/graph/registry.h"

namespace sunder::number_nodes {

inline Result<Value> cook_number(CookContext& context) {
    Force force;
    force.drag = context.parameters().number("value");
    return make_value(force);
}

inline Result<Value> cook_sum(CookContext& context) {
    auto terms = context.inputs_as<Force>("terms", context.frame());
    if (!terms) return terms.error();
    Force sum;
    for (const auto& term : *terms) sum.drag += term->drag;
    sum.drag *= context.parameters().number("factor");
    if (sum.drag > 1e6) return bad_input("", "the sum is too large");
    return make_value(sum);
}

inline Registry registry() {
    NodeType number;
    number.description = {.type = "number", .label = "Number", .category = "input", .sentence = "A number."};
    number.description.outputs = {{.name = "force", .label = "Force", .type = SocketType::force, .sentence = "It"}};
    number.description.parameters = {
        {.name = "value",
         .label = "Value",
         .unit = "m",
         .min = 0,
         .max = 1000,
         .default_value = 1.0,
         .sentence = "The number",
         .animatable = true,
         .aliases = {"amount"}},
        {.name = "limit",
         .label = "Limit",
         .min = 0,
         .min_excluded = true,
         .default_value = nullptr,
         .sentence = "Null: none",
         .animatable = true,
         .nullable = true},
        {.name = "count",
         .label = "Count",
         .type = ParameterType::integer,
         .min = 1,
         .default_value = 4,
         .sentence = "Whole",
         .choices = {1, 4, 9}},
        {.name = "axis",
         .label = "Axis",
         .type = ParameterType::vector3,
         .default_value = {0.0, 0.0, 1.0},
         .sentence = "A direction",
         .animatable = true},
        {.name = "mode",
         .label = "Mode",
         .type = ParameterType::choice,
         .default_value = "fast",
         .sentence = "One of two",
         .animatable = true,
         .choices = {"fast", "exact"},
         .former_values = {{true, "exact"}, {false, "fast"}}},
        {.name = "file",
         .label = "File",
         .type = ParameterType::path,
         .default_value = "",
         .sentence = "Read by nobody"},
        {.name = "on", .label = "On", .type = ParameterType::boolean, .default_value = true, .sentence = "A switch"}};
    number.cook = cook_number;

    NodeType sum;
    sum.description = {.type = "sum", .label = "Sum", .category = "simulation", .sentence = "Adds up."};
    sum.description.inputs = {
        {.name = "terms", .label = "Terms", .type = SocketType::force, .many = true, .sentence = "Added"},
        {.name = "mesh", .label = "Mesh", .type = SocketType::mesh, .required = false, .sentence = "Unused"}};
    sum.description.outputs = {{.name = "force", .label = "Force", .type = SocketType::force, .sentence = "The sum"}};
    sum.description.parameters = {{.name = "factor", .label = "Factor", .default_value = 1.0, .sentence = "Times"}};
    sum.cook = cook_sum;
    return Registry({number, sum});
}

inline const Registry kRegistry = registry();

/// a, b -> total -> out
inline Graph chain() {
    Graph graph(kRegistry);
    for (const auto& [name, type] : {std::pair{"a", "number"}, {"b", "number"}, {"total", "sum"}, {"out", "sum"}})
        if (!graph.add_node(name, type)) std::abort();
    if (!graph.set("total", "terms", {"@a.force", "@b.force"})) std::abort();
    if (!graph.set("out", "terms", {"@total.force"})) std::abort();
    return graph;
}

inline double drag(const Result<Value>& value) { return std::get<std::shared_ptr<const Force>>(*value)->drag; }

}  // namespace sunder::number_nodes
