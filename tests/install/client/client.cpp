// Simulates a bar of clay for three frames and counts its particles.
#include <sunder.h>

#include <cstdio>
#include <memory>

int main() {
    const char* const scene = R"({"sunder": 2, "nodes": {
        "bar": {"type": "lattice", "cells": [2, 2, 4], "size": [0.2, 0.2, 0.4], "center": [0, 0, 0.5]},
        "clay": {"type": "body", "fragments": "@bar.fragments"},
        "floor": {"type": "collider", "shape": "plane"},
        "sim": {"type": "solver", "bodies": ["@clay.body"], "colliders": ["@floor.collider"]}}})";
    sunder_graph* made = nullptr;
    sunder_graph_create(SUNDER_ABI_VERSION, &made);
    const std::unique_ptr<sunder_graph, decltype(&sunder_graph_free)> graph(made, sunder_graph_free);
    sunder_value* found = nullptr;
    sunder_array position{};
    position.struct_size = sizeof position;
    if (sunder_graph_parse(graph.get(), scene, "scene", "") != SUNDER_OK ||
        sunder_graph_evaluate(graph.get(), "sim.state", 3, nullptr, &found) != SUNDER_OK)
        return 1;
    const std::unique_ptr<sunder_value, decltype(&sunder_value_free)> state(found, sunder_value_free);
    if (sunder_value_array(state.get(), "position", &position) != SUNDER_OK) return 1;
    std::printf("%s particles %d\n", sunder_version(), static_cast<int>(position.shape[0]));
}
