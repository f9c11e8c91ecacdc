// Mesh colliders through the graph: where the mesh comes from, when the grid is made again, what is refused.
#include <gtest/gtest.h>

#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"
#include "nodes/graph/value.h"
#include "tests/nodes/temporary_folder.h"

namespace sunder {
namespace {

using ColliderPtr = std::shared_ptr<const ColliderValue>;

constexpr const char* kCube =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
constexpr const char* kSheet = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

class MeshCollider : public testing::Test {
protected:
    MeshCollider() {
        spill(folder_ / "cube.obj", kCube);
        spill(folder_ / "sheet.obj", kSheet);
    }
    Graph graph(const std::string& collider) {
        const std::string text = R"({"sunder": 1, "frame_rate": 24, "frame_range": [1, 20], "nodes": {
            "cube": {"type": "mesh_file", "path": "cube.obj"},
            "wall": {"type": "collider", "shape": "mesh", )" +
                                 collider + "}}}";
        Result<Graph> graph = Graph::from_json_text(text, "shot", folder_.path().string());
        EXPECT_TRUE(graph) << graph.error().text();
        return graph.take();
    }
    static ColliderPtr collider(Graph& io_graph, int frame = 1) {
        const Result<Value> value = io_graph.evaluate("wall", "collider", frame);
        EXPECT_TRUE(value) << value.error().text();
        return value ? std::get<ColliderPtr>(*value) : nullptr;
    }
    std::string fault(const std::string& text) {
        Graph g = graph(text);
        const Result<Value> value = g.evaluate("wall", "collider", 1);
        EXPECT_FALSE(value);
        return value ? "" : value.error().text();
    }

    TemporaryFolder folder_;
};

TEST_F(MeshCollider, wired_or_from_a_path_is_the_same) {
    Graph wired = graph(R"("mesh": "@cube.mesh", "resolution": 16)"),
          read = graph(R"("path": "cube.obj", "resolution": 16)");
    const ColliderPtr a = collider(wired), b = collider(read);
    ASSERT_TRUE(a && b && a->collider.grid && b->collider.grid);
    EXPECT_EQ(a->collider.grid->key, b->collider.grid->key);
    EXPECT_EQ(a->collider.grid->distance, b->collider.grid->distance);
    EXPECT_EQ(a->collider.shape.grid, a->collider.grid.get());
    EXPECT_TRUE(a->warnings.empty());
}

TEST_F(MeshCollider, the_grid_is_made_again_for_another_mesh_and_not_for_another_place) {
    Graph g = graph(R"("mesh": "@cube.mesh", "resolution": 16,
                       "position": {"keys": [[1, [0, 0, 0]], [20, [1, 0, 0]]]})");
    const ColliderPtr first = collider(g, 1), last = collider(g, 20);
    EXPECT_NE(first->pose.position, last->pose.position);
    EXPECT_EQ(first->collider.grid, last->collider.grid);
    ASSERT_TRUE(g.set("wall", "friction", 0.1));
    EXPECT_EQ(collider(g)->collider.grid, first->collider.grid);
    ASSERT_TRUE(g.set("cube", "scale", 2.0));
    const ColliderPtr larger = collider(g);
    EXPECT_NE(larger->collider.grid->key, first->collider.grid->key);
    EXPECT_NEAR(larger->collider.grid->bounds.max.x(), 2, 1e-9);
    ASSERT_TRUE(g.set("wall", "scale", 0.5));
    EXPECT_EQ(collider(g)->collider.grid->key, first->collider.grid->key);
    ASSERT_TRUE(g.set("wall", "voxel_size", 0.1));
    EXPECT_EQ(collider(g)->collider.grid->voxel_size, 0.1);
}

TEST_F(MeshCollider, what_cannot_be_is_refused_by_name) {
    EXPECT_NE(fault(R"("resolution": 16)").find("no mesh is wired, and no path given"), std::string::npos);
    EXPECT_NE(fault(R"("mesh": "@cube.mesh", "path": "cube.obj")").find("is wired, and a path given"),
              std::string::npos);
    EXPECT_NE(fault(R"("path": "none.obj")").find("none.obj"), std::string::npos);
    EXPECT_NE(fault(R"("path": "sheet.obj")").find("thickness"), std::string::npos);
    EXPECT_NE(fault(R"("path": "cube.obj", "resolution": 1000)").find("voxel size of 0.0026 m fits"),
              std::string::npos);
    Graph sheet = graph(R"("path": "sheet.obj", "thickness": 0.1, "resolution": 40)");
    EXPECT_TRUE(collider(sheet));
}

TEST_F(MeshCollider, its_grid_is_part_of_the_simulation_s_key) {
    uint64_t hash[3];
    for (int k = 0; k < 3; ++k) {
        const std::string text =
            R"({"sunder": 1, "frame_rate": 24, "frame_range": [1, 20], "nodes": {
            "cube": {"type": "mesh_file", "path": "cube.obj", "scale": )" +
            std::string(k == 1 ? "0.5" : "1") + R"(},
            "bar": {"type": "lattice", "size": [0.2, 0.2, 0.2], "cells": [2, 2, 2], "center": [0.5, 0.5, 1.12]},
            "clay": {"type": "body", "fragments": "@bar.fragments"},
            "wall": {"type": "collider", "shape": "mesh", "mesh": "@cube.mesh", "resolution": 16},
            "sim": {"type": "solver", "bodies": ["@clay.body"], "colliders": ["@wall.collider"]}}})";
        Result<Graph> g = Graph::from_json_text(text, "shot", folder_.path().string());
        ASSERT_TRUE(g) << g.error().text();
        const Result<Value> value = g->evaluate("sim", "state", 8);
        ASSERT_TRUE(value) << value.error().text();
        const auto state = std::get<std::shared_ptr<const StateValue>>(*value);
        hash[k] = state_hash(*state->state);
        double low = 1e300;
        for (const Vec3& x : state->state->position) low = std::min(low, x.z());
        EXPECT_TRUE(k == 1 ? low < 0.95 : std::abs(low - 1.05) < 0.02) << low;
    }
    EXPECT_EQ(hash[0], hash[2]);
    EXPECT_NE(hash[0], hash[1]);
}

}  // namespace
}  // namespace sunder
