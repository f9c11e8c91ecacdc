// A bake by several threads, with its frames' writer and a job that is cancelled: what the thread sanitizer looks at
// (`./sunder test --all threads`), and the bits of one thread.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>

#include "nodes/bake.h"
#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"
#include "plugin_src/c_api/sunder.h"
#include "tests/nodes/temporary_folder.h"

namespace sunder {
namespace {

// Enough particles that every loop is shared out: two blocks that break one another.
const char* const kScene = R"({"sunder": 2, "frame_rate": 24, "frame_range": [1, 4], "nodes": {
  "block": {"type": "lattice", "size": [0.4, 0.4, 0.4], "cells": [8, 8, 8], "center": [0, 0, 0.25]},
  "clay":  {"type": "body", "fragments": "@block.fragments", "youngs_modulus": 1e5, "yield": 0.01, "toughness": 0.05},
  "fall":  {"type": "body", "fragments": "@block.fragments", "youngs_modulus": 1e5, "toughness": 0.05,
            "position": [0.1, 0, 0.42], "velocity": [0, 0, -5]},
  "ball":  {"type": "rigid_body", "radius": 0.1, "mass": 20, "position": [0.3, 0, 0.3], "velocity": [-5, 0, 0]},
  "floor": {"type": "collider"},
  "sim":   {"type": "solver", "bodies": ["@clay.body", "@fall.body"], "rigid_bodies": ["@ball.rigid_body"],
            "colliders": ["@floor.collider"], "preset": "preview"},
  "skin":  {"type": "deformer", "body": "@clay.body", "state": "@sim.state"},
  "skin2": {"type": "deformer", "body": "@fall.body", "state": "@sim.state", "topology": "constant"},
  "mesh":  {"type": "bake_mesh", "mesh": "@skin.mesh", "path": "mesh/a.####.ply", "compression": "zstd"},
  "mesh2": {"type": "bake_mesh", "mesh": "@skin2.mesh", "path": "mesh/b.####.ply"},
  "out":   {"type": "bake_state", "state": "@sim.state"}}})";

std::map<std::string, std::string> baked(const std::filesystem::path& folder, int threads) {
    auto graph = Graph::from_json_text(kScene, "scene", "");
    EXPECT_TRUE(graph) << graph.error().text();
    EXPECT_TRUE(graph->set_threads(threads));
    BakeSettings settings;
    settings.folder = folder.string();
    const auto report = bake(*graph, settings);
    EXPECT_TRUE(report) << report.error().text();
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.path().extension() == ".ply" || entry.path().extension() == ".zst")
            files[entry.path().filename().string()] = slurp(entry.path());
    EXPECT_EQ(files.size(), 4u * 3u);
    return files;
}

TEST(ThreadedBake, writes_the_bits_of_one_thread) {
    TemporaryFolder folder;
    EXPECT_EQ(baked(folder / "four", 4), baked(folder / "one", 1));
}

TEST(ThreadedBake, a_job_is_looked_at_and_cancelled_while_it_works) {
    TemporaryFolder folder;
    sunder_graph* graph = nullptr;
    ASSERT_EQ(sunder_graph_create(SUNDER_ABI_VERSION, &graph), SUNDER_OK);
    ASSERT_EQ(sunder_graph_parse(graph, kScene, "scene", ""), SUNDER_OK);
    ASSERT_EQ(sunder_graph_set_threads(graph, 4), SUNDER_OK);
    const std::string path = (folder / "bake").string();
    const sunder_bake_settings settings{sizeof settings, SUNDER_BAKE_RESTART, path.c_str(), 1, 1, 1000};
    sunder_job* job = nullptr;
    ASSERT_EQ(sunder_graph_start_bake(graph, &settings, &job), SUNDER_OK);
    sunder_job_state state{};
    state.struct_size = sizeof state;
    while (state.fraction == 0 && !sunder_job_wait(job, 0.001)) sunder_job_look(job, &state);
    sunder_graph_cancel(graph);
    EXPECT_EQ(sunder_job_finish(job, nullptr), SUNDER_CANCELLED);
    sunder_job_free(job);
    sunder_graph_free(graph);
}

}  // namespace
}  // namespace sunder
