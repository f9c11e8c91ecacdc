// fragment_region nodes in real graphs: what they choose, and that it reaches the body.
#include <gtest/gtest.h>

#include <cmath>

#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"

namespace sunder {
namespace {

constexpr const char* kBar = R"({ "sunder": 1, "nodes": {
    "cells": {"type": "lattice", "size": [4, 1, 1], "cells": [4, 1, 1], "center": [2, 0.5, 0.5]},
    "left":  {"type": "fragment_region", "fragments": "@cells.fragments", "box_min": [0, 0, 0], "box_max": [2, 1, 1],
              "toughness": 3, "density": 2, "interface_toughness": null},
    "ball":  {"type": "fragment_region", "fragments": "@left.fragments", "region": "sphere", "center": [1.5, 0.5, 0.5],
              "radius": 1.1, "toughness": 0.5, "yield": 0.1, "interface_toughness": 0.2},
    "clay":  {"type": "body", "fragments": "@ball.fragments", "density": 10} } })";

Graph graph_of(const char* text) {
    Result<Graph> graph = Graph::from_json_text(text, "bar", "");
    EXPECT_TRUE(graph) << (graph ? "" : graph.error().text());
    return graph.take();
}

TEST(FragmentRegionNode, regions_follow_one_another_into_the_body) {
    Graph graph = graph_of(kBar);
    const Result<Value> value = graph.evaluate("clay", "body", 1);
    ASSERT_TRUE(value) << value.error().text();
    const SimulationMesh& rest = *std::get<std::shared_ptr<const BodyValue>>(*value)->rest;
    EXPECT_EQ(rest.toughness_factor, (std::vector<double>{1.5, 1.5, 0.5, 1}));
    EXPECT_EQ(rest.yield_factor, (std::vector<double>{0.1, 0.1, 0.1, 1}));
    EXPECT_EQ(rest.mass, (std::vector<double>{20, 20, 10, 10}));
    EXPECT_TRUE(std::isinf(rest.edges[0].toughness_factor));
    EXPECT_EQ(rest.edges[1].toughness_factor, 0.2);
    EXPECT_EQ(rest.edges[2].toughness_factor, 1);
}

TEST(FragmentRegionNode, an_empty_region_is_an_error_that_names_the_node) {
    Graph graph = graph_of(kBar);
    ASSERT_TRUE(graph.set("left", "box_max", Json::array({0.1, 0.1, 0.1})));
    const Result<Value> value = graph.evaluate("ball", "fragments", 1);
    ASSERT_FALSE(value);
    EXPECT_EQ(value.error().node, "left");
    EXPECT_EQ(value.error().parameter, "region");
}

TEST(FragmentRegionNode, unknown_groups_and_crossed_boxes_are_refused) {
    Graph graph = graph_of(kBar);
    ASSERT_TRUE(graph.set("left", "region", "group"));
    ASSERT_TRUE(graph.set("left", "group", "ears"));
    const Result<Value> value = graph.evaluate("left", "fragments", 1);
    ASSERT_FALSE(value);
    EXPECT_EQ(value.error().parameter, "group");
    Graph crossed = graph_of(kBar);
    ASSERT_TRUE(crossed.set("left", "box_min", Json::array({3.0, 0.0, 0.0})));
    EXPECT_FALSE(crossed.evaluate("left", "fragments", 1));
}

}  // namespace
}  // namespace sunder
