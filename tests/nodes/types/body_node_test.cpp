#include <gtest/gtest.h>

#include "nodes/graph/graph.h"
#include "nodes/graph/value_arrays.h"

namespace sunder {
namespace {

Graph body_graph(int version, const std::string& parameters, const std::string& size = "0.2") {
    const std::string text = R"({"sunder": )" + std::to_string(version) + R"(, "frame_rate": 24, "frame_range": [1, 9],
        "nodes": {
            "bar": {"type": "lattice", "size": [)" +
                             size + ", " + size + ", " + size + R"(], "cells": [2, 2, 2]},
            "rubber": {"type": "body", "fragments": "@bar.fragments", "density": 1000)" +
                             parameters + R"(},
            "sim": {"type": "solver", "bodies": ["@rubber.body"], "gravity": [0, 0, -9.81], "error_budget": 0.05}}})";
    auto graph = Graph::from_json_text(text, "graph", "");
    EXPECT_TRUE(graph) << graph.error().text();
    return graph.take();
}

// What a budget chose is told: a report once left it out.
TEST(BodyNode, a_state_tells_what_its_frame_took) {
    Graph graph = body_graph(1, "");
    const auto state = graph.evaluate("sim", "state", 3);
    ASSERT_TRUE(state) << state.error().text();
    const Json report = value_info(*state)["report"];
    EXPECT_EQ(report["substeps"], 1);  // it falls
    EXPECT_EQ(report["iterations"], 2);
    EXPECT_EQ(report["simulated"], 8);
}

}  // namespace
}  // namespace sunder
