#include <gtest/gtest.h>

#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"
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

double damping_time(Graph graph, int frame = 1) {
    const auto body = graph.evaluate("rubber", "body", frame);
    EXPECT_TRUE(body) << body.error().text();
    return value_info(*body)["material"]["damping_time"].get<double>();
}

const std::string kNamed = R"(, "damping_time": 0.002, "fracture_energy": null)";
const std::string kAuto = R"(, "damping_time": "auto", "fracture_energy": "auto")";

TEST(BodyNode, damping_is_automatic_from_version_2_of_graphs_on) {
    const double wave = 0.3 * 0.1 / std::sqrt(2e5 / 1000);
    EXPECT_EQ(damping_time(body_graph(1, "")), 0.002);
    EXPECT_NEAR(damping_time(body_graph(2, "")), wave, 1e-12);
    EXPECT_NEAR(damping_time(body_graph(1, kAuto)), wave, 1e-12);
    EXPECT_EQ(damping_time(body_graph(2, kNamed)), 0.002);
    EXPECT_NEAR(damping_time(body_graph(2, R"(, "youngs_modulus": 8e5)")), wave / 2, 1e-12);
    EXPECT_NEAR(damping_time(body_graph(2, "", "0.4")), 2 * wave, 1e-12);
    const std::string animated = R"(, "youngs_modulus": {"keys": [[1, 2e5], [5, 8e5]]})";
    EXPECT_NEAR(damping_time(body_graph(2, animated), 5), wave / 2, 1e-12);
}

// Bakes of a graph of version 1 go on, under either version, if what was left out is named.
TEST(BodyNode, what_version_1_left_out_has_the_key_of_the_same_value) {
    EXPECT_EQ(body_graph(1, "").keys(), body_graph(2, kNamed).keys());
    EXPECT_EQ(body_graph(1, kAuto).keys(), body_graph(2, "").keys());
    EXPECT_NE(body_graph(1, "").keys(), body_graph(2, "").keys());
}

TEST(BodyNode, graphs_keep_their_version) {
    for (const int version : {1, 2}) {
        const Graph graph = body_graph(version, "");
        EXPECT_EQ(graph.version(), version);
        EXPECT_EQ(graph.to_json()["sunder"], version);
        const Json full = graph.to_json(Defaults::write);
        EXPECT_EQ(full["nodes"]["rubber"]["damping_time"], version == 1 ? Json(0.002) : Json("auto"));
        EXPECT_EQ(full["nodes"]["rubber"]["fracture_energy"], version == 1 ? Json() : Json("auto"));
        const auto again = Graph::from_json_text(full.dump(), "again", "");
        ASSERT_TRUE(again) << again.error().text();
        EXPECT_EQ(again->keys(), graph.keys());
    }
    EXPECT_EQ(Graph().version(), 2);
}

TEST(BodyNode, automatic_is_refused_where_it_means_nothing) {
    Graph graph = body_graph(2, "");
    EXPECT_FALSE(graph.set("rubber", "damping_time", "automatic"));
    EXPECT_FALSE(graph.set("rubber", "damping_time", nullptr));
    EXPECT_FALSE(graph.set("rubber", "youngs_modulus", "auto"));
    const Status blended = graph.set("rubber", "damping_time", Json::parse(R"({"keys": [[1, "auto"], [5, 0.1]]})"));
    ASSERT_FALSE(blended);
    EXPECT_NE(blended.error().what.find("\"auto\" cannot be blended"), std::string::npos) << blended.error().text();
    EXPECT_TRUE(graph.set("rubber", "damping_time",
                          Json::parse(R"({"keys": [[1, "auto"], [5, 0.1]], "interpolation": "step"})")));
    EXPECT_EQ(damping_time(std::move(graph), 6), 0.1);
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
