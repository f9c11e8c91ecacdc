// Deformer nodes in a graph: the meshes of several bodies, made together, are those of each alone.
#include <gtest/gtest.h>

#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"

namespace sunder {
namespace {

// Two blocks that fall on one another and break, and a third one of another solver that is torn by its fall.
constexpr const char* kScene = R"({ "sunder": 1, "frame_range": [1, 12], "nodes": {
  "cells": {"type": "lattice", "size": [0.3, 0.3, 0.3], "cells": [3, 3, 3], "center": [0, 0, 0.15]},
  "large": {"type": "lattice", "size": [0.4, 0.4, 0.4], "cells": [4, 4, 4], "center": [0, 0, 0.2]},
  "low":   {"type": "body", "fragments": "@cells.fragments", "youngs_modulus": 1e5, "toughness": 0.03},
  "high":  {"type": "body", "fragments": "@large.fragments", "position": [0.1, 0, 0.35], "velocity": [0, 0, -5],
            "youngs_modulus": 1e5, "toughness": 0.03},
  "apart": {"type": "body", "fragments": "@cells.fragments", "position": [0, 0, 0.05], "velocity": [0, 0, -6],
            "youngs_modulus": 1e5, "toughness": 0.03},
  "floor": {"type": "collider", "shape": "plane"},
  "sim":   {"type": "solver", "bodies": ["@low.body", "@high.body"], "colliders": ["@floor.collider"], "substeps": 4},
  "other": {"type": "solver", "bodies": ["@apart.body"], "colliders": ["@floor.collider"], "substeps": 4},
  "low_skin":   {"type": "deformer", "body": "@low.body", "state": "@sim.state"},
  "high_skin":  {"type": "deformer", "body": "@high.body", "state": "@sim.state"},
  "whole_skin": {"type": "deformer", "body": "@high.body", "state": "@sim.state", "topology": "constant"},
  "apart_skin": {"type": "deformer", "body": "@apart.body", "state": "@other.state"} } })";

const std::vector<SocketReference> kSkins = {
    {"low_skin", "mesh"}, {"high_skin", "mesh"}, {"whole_skin", "mesh"}, {"apart_skin", "mesh"}};

Graph scene(int threads) {
    auto graph = Graph::from_json_text(kScene, "scene", "");
    EXPECT_TRUE(graph) << graph.error().text();
    EXPECT_TRUE(graph->set_threads(threads));
    return graph.take();
}

const BodyMesh& mesh_of(const Result<Value>& value) { return *std::get<std::shared_ptr<const BodyMesh>>(*value); }

void expect_same(const BodyMesh& a, const BodyMesh& b, const std::string& where) {
    EXPECT_EQ(a.body, b.body) << where;
    EXPECT_EQ(a.mesh.positions, b.mesh.positions) << where;
    EXPECT_EQ(a.mesh.velocities, b.mesh.velocities) << where;
    EXPECT_EQ(a.mesh.triangles, b.mesh.triangles) << where;
    EXPECT_EQ(a.mesh.corner_normals, b.mesh.corner_normals) << where;
    EXPECT_EQ(a.mesh.triangle_interface, b.mesh.triangle_interface) << where;
    EXPECT_EQ(a.mesh.triangle_hidden, b.mesh.triangle_hidden) << where;
    EXPECT_EQ(a.mesh.vertex_fragment, b.mesh.vertex_fragment) << where;
}

TEST(DeformerNode, bodies_of_several_solvers_made_together_have_the_bits_of_each_alone) {
    for (const int threads : {1, 3}) {
        Graph together = scene(threads), alone = scene(1);
        std::vector<size_t> first, last;  // vertices
        for (const int frame : {1, 2, 3, 4, 6, 8, 12, 5}) {
            const auto values = together.evaluate_all(kSkins, frame);
            last.clear();
            for (size_t i = 0; i < kSkins.size(); ++i) {
                ASSERT_TRUE(values[i]) << values[i].error().text();
                const size_t other = kSkins.size() - 1 - i;  // in another order
                const auto single = alone.evaluate(kSkins[other].node, "mesh", frame);
                expect_same(mesh_of(values[other]), mesh_of(single),
                            kSkins[other].node + ", frame " + std::to_string(frame));
                last.push_back(mesh_of(values[i]).mesh.positions.size());
            }
            if (frame == 1) first = last;
        }
        for (const size_t i : {0, 1, 3}) EXPECT_GT(last[i], first[i]) << kSkins[i].node << " has not torn";
        EXPECT_EQ(together.cook_count("low_skin"), 8u);
        EXPECT_EQ(together.cook_count("sim"), alone.cook_count("sim"));
    }
}

TEST(DeformerNode, a_body_that_its_solver_does_not_move_is_the_only_one_without_a_mesh) {
    Graph graph = scene(2);
    ASSERT_TRUE(graph.set("high_skin", "state", "@other.state"));
    const auto values = graph.evaluate_all(kSkins, 2);
    ASSERT_FALSE(values[1]);
    EXPECT_EQ(values[1].error().node, "high_skin");
    EXPECT_EQ(values[1].error().parameter, "state");
    for (const size_t i : {0, 2, 3}) EXPECT_TRUE(values[i]) << kSkins[i].node;
    EXPECT_EQ(graph.evaluate("high_skin", "mesh", 2).error().text(), values[1].error().text());
    for (const char* skin : {"low_skin", "whole_skin", "apart_skin"}) {
        ASSERT_TRUE(graph.evaluate(skin, "mesh", 2));
        EXPECT_EQ(graph.cook_count(skin), 1u) << skin;
    }
}

TEST(DeformerNode, cancelled_in_one_solver_the_other_does_not_begin) {
    Graph graph = scene(2);
    std::vector<std::string> told;
    const Progress::Callback stop_once = [&](double, std::string_view text) {
        told.emplace_back(text);
        return told.size() != 3;
    };
    for (const Result<Value>& value : graph.evaluate_all(kSkins, 8, Progress(stop_once))) {
        ASSERT_FALSE(value);
        EXPECT_EQ(value.error().code, ErrorCode::cancelled);
    }
    EXPECT_EQ(told.size(), 3u);
    EXPECT_EQ(graph.cook_count("other"), 0u);
    for (const Result<Value>& value : graph.evaluate_all(kSkins, 8)) EXPECT_TRUE(value);
}

}  // namespace
}  // namespace sunder
