#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"
#include "tests/nodes/number_nodes.h"

namespace sunder {
namespace {

/// The example of docs: a bunny that falls apart.
constexpr const char* kShot = R"({ "sunder": 1, "frame_rate": 24, "frame_range": [1, 96],
  "nodes": {
    "bunny":  {"type": "mesh_file",   "path": "bunny.obj"},
    "pieces": {"type": "prefracture", "mesh": "@bunny.mesh", "method": "kmeans", "pieces": 300, "seed": 7},
    "lead":   {"type": "body",        "fragments": "@pieces.fragments", "position": [0, 0, 1], "velocity": [0, 0, 0],
               "density": 1000, "youngs_modulus": 2e5, "yield": 0.05, "flow_rate": 30, "hardening": 0.0, "toughness": 0.25},
    "weight": {"type": "rigid_body",  "shape": "sphere", "radius": 0.4, "mass": 50, "position": [0, 0, 3], "velocity": [0, 0, -4]},
    "floor":  {"type": "collider",    "shape": "plane", "friction": 0.5},
    "sim":    {"type": "solver", "bodies": ["@lead.body"], "rigid_bodies": ["@weight.rigid_body"], "colliders": ["@floor.collider"],
               "substeps": 8, "iterations": 2, "gravity": [0, 0, -9.81]},
    "skin":   {"type": "deformer", "body": "@lead.body", "state": "@sim.state", "topology": "compact"},
    "out":    {"type": "bake_mesh",  "mesh": "@skin.mesh",  "path": "mesh/bunny.####.ply"},
    "cache":  {"type": "bake_state", "state": "@sim.state", "path": "state/sim.####.ply"} } })";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

Error fault(const std::string& text) {
    const Result<Graph> graph = Graph::from_json_text(text, "shot.json", "");
    EXPECT_FALSE(graph) << text;
    return graph ? Error{} : graph.error();
}

struct Refusal {
    const char *from, *to, *node, *parameter, *says;
};

TEST(GraphFile, reads_the_shot_and_writes_it_again) {
    Result<Graph> graph = Graph::from_json_text(kShot, "shot.json", "");
    ASSERT_TRUE(graph) << graph.error().text();
    const Json written = graph->to_json();
    EXPECT_EQ(written["nodes"].size(), 9u);
    EXPECT_EQ(written["nodes"].begin().key(), "bunny");
    EXPECT_EQ(written["nodes"]["sim"]["bodies"], Json::array({"@lead.body"}));
    Result<Graph> again = Graph::from_json_text(written.dump(2), "again", "");
    ASSERT_TRUE(again) << again.error().text();
    EXPECT_EQ(again->to_json(), written);
    EXPECT_EQ(again->keys(), graph->keys());
    // Every number of the file is there, and nothing else is.
    const Json original = Json::parse(kShot);
    for (const auto& [name, node] : original["nodes"].items())
        for (const auto& [key, value] : node.items())
            EXPECT_EQ(written["nodes"][name][key], value) << name << "." << key;
}

TEST(GraphFile, written_with_defaults_means_the_same) {
    Result<Graph> graph = Graph::from_json_text(kShot, "shot.json", "");
    ASSERT_TRUE(graph);
    const Json full = graph->to_json(Defaults::write);
    EXPECT_EQ(full["nodes"]["lead"]["poisson_ratio"], 0.0);
    Result<Graph> again = Graph::from_json_text(full.dump(), "full", "");
    ASSERT_TRUE(again) << again.error().text();
    EXPECT_EQ(again->keys(), graph->keys());
}

TEST(GraphFile, reads_animation_null_and_pins) {
    const char* const kBar = R"({ "sunder": 1, "frame_range": [1, 240], "nodes": {
        "head": {"type": "pin", "body": "@rubber.body", "box_min": [-1, -1, 0.9], "box_max": [1, 1, 2], "pivot": [0, 0, 0.9],
                 "rotation": {"keys": [[1, [0, 0, 0]], [48, [0, 0, 90]]]}, "release_frame": null},
        "rubber": {"type": "body", "fragments": "@bar.fragments", "yield": null, "toughness": null},
        "bar": {"type": "lattice", "size": [0.2, 0.2, 1.0], "cells": [4, 4, 20], "neighbours": 6}}})";
    Result<Graph> graph = Graph::from_json_text(kBar, "bar.json", "");
    ASSERT_TRUE(graph) << graph.error().text();
    EXPECT_EQ(graph->frame_rate().per_second(), 24);
    EXPECT_TRUE(graph->parameter("rubber", "yield")->is_null());
    EXPECT_EQ((*graph->parameter_at("head", "rotation", 24.5))[2].get<double>(), 45);
}

TEST(GraphFile, a_frame_rate_may_be_a_ratio) {
    Result<Graph> graph = Graph::from_json_text(
        replaced(kShot, R"("frame_rate": 24)", R"("frame_rate": [48000, 2002])"), "shot.json", "");
    ASSERT_TRUE(graph) << graph.error().text();
    EXPECT_EQ(graph->to_json()["frame_rate"], Json::array({24000, 1001}));  // in lowest terms
    EXPECT_EQ(graph->frame_rate().seconds(24000 * 7.0), 7 * 1001.0);        // no drift
    EXPECT_EQ(graph->frame_rate().text(), "24000/1001");
    const auto keys = graph->keys();
    ASSERT_TRUE(graph->set_frame_rate(24));
    EXPECT_EQ(graph->to_json()["frame_rate"], 24);
    EXPECT_NE(graph->keys(), keys);
    ASSERT_TRUE(graph->set_frame_rate(24000, 1000));
    EXPECT_EQ(graph->to_json()["frame_rate"], 24);
}

TEST(GraphFile, refuses_what_is_wrong_and_names_it) {
    const Refusal refusals[] = {
        {R"("sunder": 1)", R"("sunder": 3)", "", "", "version 3 is not known"},
        {R"("sunder": 1)", R"("sunder": "2")", "", "", "reads versions 1 to 2"},
        {R"("sunder": 1)", R"("sundre": 1)", "", "", "not a graph of Sunder"},
        {R"("sunder": 1)", R"("sunder": 1, "fps": 3)", "", "", "no setting 'fps'"},
        {R"("frame_range": [1, 96])", R"("frame_range": [96, 1])", "", "", "[96, 1] is reversed"},
        {R"("frame_range": [1, 96])", R"("frame_range": [1, 96.5])", "", "", "two whole numbers"},
        {R"("frame_range": [1, 96])", R"("frame_range": [1, 99999999999999])", "", "", "two whole numbers"},
        {R"("frame_rate": 24)", R"("frame_rate": "24")", "", "", "takes a number"},
        {R"("frame_rate": 24)", R"("frame_rate": -24)", "", "", "out of range"},
        {R"("frame_rate": 24)", R"("frame_rate": [24, 0])", "", "", "a ratio takes whole numbers"},
        {R"("frame_rate": 24)", R"("frame_rate": [23.976, 2])", "", "", "a ratio takes whole numbers"},
        {R"("frame_rate": 24)", R"("frame_rate": [1001, 24000])", "", "", "out of range"},
        {R"("frame_rate": 24)", R"("frame_rate": [24000, 1001, 1])", "", "", "or a ratio"},
        {R"("type": "mesh_file")", R"("type": "mesh_fiel")", "bunny", "type", "did you mean 'mesh_file'?"},
        {R"("type": "mesh_file")", R"("type": 3)", "bunny", "type", "takes a text"},
        {R"("type": "mesh_file",   )", "", "bunny", "type", "missing"},
        {R"("path": "bunny.obj")", R"("path": "")", "bunny", "path", "no file"},
        {R"("density": 1000)", R"("denisty": 1000)", "lead", "denisty", "did you mean 'density'?"},
        {R"("density": 1000)", R"("density": -1)", "lead", "density", "permitted: 0 < value"},
        {R"("density": 1000)", R"("density": "heavy")", "lead", "density", "takes a number"},
        {R"("density": 1000)", R"("density": null)", "lead", "density", "not null"},
        {R"("density": 1000)", R"("density": {"keys": [[1, 2]]})", "lead", "density", "cannot be animated"},
        {R"("density": 1000)", R"("density": 1e999)", "", "", "too large to be finite"},
        {R"("density": 1000)", R"("density": 1000, "density": 1)", "", "", "'nodes.lead.density' appears twice"},
        {R"("density": 1000)", R"("density": 1000, "poisson_ratio": 0.46)", "lead", "poisson_ratio", "0.45"},
        {R"("mass": 50)", R"("mass": -50)", "weight", "mass", "permitted: 0 < value"},
        {R"("pieces": 300)", R"("pieces": 0)", "pieces", "pieces", "1 <= value <= 100000"},
        {R"("shape": "plane")", R"("shape": "plain")", "floor", "shape", "did you mean 'plane'?"},
        {R"("mesh": "@bunny.mesh")", R"("mesh": "@bunny.fragments")", "pieces", "mesh", "has no output 'fragments'"},
        {R"("mesh": "@bunny.mesh")", R"("mesh": "@lead.body")", "pieces", "mesh",
         "takes a mesh, but 'lead.body' is a body"},
        {R"("mesh": "@bunny.mesh")", R"("mesh": "@bnny.mesh")", "pieces", "mesh", "did you mean 'bunny'?"},
        {R"("mesh": "@bunny.mesh", )", "", "pieces", "mesh", "nothing is wired"},
        {R"("bodies": ["@lead.body"])", R"("bodies": [])", "sim", "bodies", "nothing is wired"},
        {R"("bodies": ["@lead.body"])", R"("bodies": ["@lead.body", 4])", "sim", "bodies", "list of wires"},
        {R"("path": "mesh/bunny.####.ply")", R"("path": "../bunny.####.ply")", "out", "path",
         "leaves the output folder"},
        {R"("path": "mesh/bunny.####.ply")", R"("path": "bunny.ply")", "out", "path", "####"},
    };
    for (const Refusal& r : refusals) {
        const Error error = fault(replaced(kShot, r.from, r.to));
        EXPECT_EQ(error.code, ErrorCode::bad_input) << r.to;
        EXPECT_EQ(error.node, r.node) << r.to;
        EXPECT_EQ(error.parameter, r.parameter) << r.to;
        EXPECT_NE(error.text().find(r.says), std::string::npos) << r.to << ": " << error.text();
    }
}

TEST(GraphFile, every_cut_off_file_is_refused_with_its_place) {
    const std::string shot = kShot;
    for (size_t n = 0; n < shot.size(); n += 7) {
        const Error error = fault(shot.substr(0, n));
        EXPECT_NE(error.what.find("line "), std::string::npos) << n << ": " << error.text();
    }
}

TEST(GraphFile, refuses_a_value_under_both_of_its_names) {
    const Result<Graph> graph =
        Graph::from_json_text(R"({"sunder": 1, "nodes": {"a": {"type": "number", "value": 1, "amount": 2}}})", "", "",
                              number_nodes::kRegistry);
    ASSERT_FALSE(graph);
    EXPECT_NE(graph.error().text().find("'amount' is an older name of 'value'"), std::string::npos)
        << graph.error().text();
}

TEST(GraphFile, refuses_cycles) {
    const Result<Graph> graph = Graph::from_json_text(
        R"({"sunder": 1, "nodes": {"a": {"type": "sum", "terms": ["@b.force"]}, "b": {"type": "sum", "terms": ["@a.force"]}}})",
        "", "", number_nodes::kRegistry);
    ASSERT_FALSE(graph);
    EXPECT_EQ(graph.error().node, "b");
    EXPECT_NE(graph.error().text().find("b -> a -> b"), std::string::npos) << graph.error().text();
}

TEST(GraphFile, tells_of_a_missing_file_and_of_a_folder) {
    for (const std::string path : {"no/such/graph.json", "."}) {
        const Result<Graph> graph = Graph::load(path);
        ASSERT_FALSE(graph);
        EXPECT_EQ(graph.error().code, ErrorCode::bad_input);
        EXPECT_EQ(graph.error().where, path);
    }
}

TEST(GraphFile, input_paths_are_seen_from_the_graphs_folder) {
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "sunder_graph_file_test";
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "shot.json") << kShot;
    Result<Graph> graph = Graph::load((folder / "shot.json").string());
    ASSERT_TRUE(graph) << graph.error().text();
    EXPECT_EQ(graph->base_folder(), folder.string());
    const Result<Value> mesh = graph->evaluate("bunny", "mesh", 1);
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().node, "bunny");
    EXPECT_EQ(mesh.error().parameter, "path");
    EXPECT_NE(mesh.error().text().find((folder / "bunny.obj").string()), std::string::npos) << mesh.error().text();
    std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace sunder
