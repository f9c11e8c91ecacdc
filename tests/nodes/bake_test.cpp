#include "nodes/bake.h"

#include <sys/resource.h>

#include <csignal>
#include <map>
#include <set>

#include "nodes/bake_files/bake_folder.h"
#include "nodes/bake_files/manifest.h"
#include "nodes/files/state_file.h"
#include "nodes/graph/json.h"
#include "tests/nodes/temporary_folder.h"

namespace sunder {
namespace {

// A small brittle block under a falling ball: every kind of state there is (contacts, a rigid body, broken edges,
// hardening).
const char* const kScene = R"({"sunder": 1, "frame_rate": 24, "frame_range": [1, 10], "nodes": {
  "block": {"type": "lattice", "size": [0.3, 0.3, 0.3], "cells": [3, 3, 3], "center": [0, 0, 0.2]},
  "clay":  {"type": "body", "fragments": "@block.fragments", "youngs_modulus": 1e5, "yield": 0.01, "flow_rate": 20, "hardening": 0.5, "toughness": 0.06},
  "ball":  {"type": "rigid_body", "shape": "sphere", "radius": 0.1, "mass": 20, "position": [0.03, 0.02, 0.6], "velocity": [0, 0, -6]},
  "floor": {"type": "collider", "shape": "plane"},
  "sim":   {"type": "solver", "bodies": ["@clay.body"], "rigid_bodies": ["@ball.rigid_body"], "colliders": ["@floor.collider"], "substeps": 4},
  "skin":  {"type": "deformer", "body": "@clay.body", "state": "@sim.state"},
  "out":   {"type": "bake_mesh", "mesh": "@skin.mesh", "path": "mesh/block.###.obj"},
  "cache": {"type": "bake_state", "state": "@sim.state", "path": "state/sim.####.ply"}}})";

Graph scene(bool with_states = true) {
    auto graph = Graph::from_json_text(kScene, "scene", "");
    EXPECT_TRUE(graph) << graph.error().text();
    if (!with_states) {
        EXPECT_TRUE(graph->remove_node("cache"));
    }
    EXPECT_TRUE(graph->set_threads(1));
    return graph.take();
}

BakeSettings settings(const std::filesystem::path& folder, BakeStart start = BakeStart::fresh,
                      std::optional<std::array<int, 2>> frames = {}) {
    BakeSettings s;
    s.folder = folder.string();
    s.start = start;
    s.frames = frames;
    return s;
}

// Every file below a folder with its bytes.
std::map<std::string, std::string> contents(const std::filesystem::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.is_regular_file())
            files[std::filesystem::relative(entry.path(), folder).string()] = slurp(entry.path());
    return files;
}

Error refused(const Result<BakeReport>& report) {
    EXPECT_FALSE(report);
    return report ? Error{} : report.error();
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

class Bake : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(States, Bake, testing::Bool(),
                         [](const auto& info) { return info.param ? "baked_states" : "hidden_states"; });

TEST_P(Bake, resumed_after_any_frame_gives_the_bits_of_an_unbroken_run) {
    TemporaryFolder folder;
    Graph whole = scene(GetParam());
    const auto report = bake(whole, settings(folder / "whole"));
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_EQ(report->n_frames, 10u);
    const auto wanted = contents(folder / "whole");
    for (int stop : {1, 4, 9}) {
        const std::string name = "stopped" + std::to_string(stop);
        Graph first = scene(GetParam());
        ASSERT_TRUE(bake(first, settings(folder / name, BakeStart::fresh, {{1, stop}})));
        Graph second = scene(GetParam());
        const auto rest = bake(second, settings(folder / name, BakeStart::resume));
        ASSERT_TRUE(rest) << rest.error().text();
        EXPECT_EQ(rest->first_new_frame, stop + 1);
        EXPECT_EQ(rest->n_frames, static_cast<size_t>(10 - stop));
        EXPECT_EQ(contents(folder / name), wanted) << stop;  // manifest included
    }
}

TEST(Bake, the_scene_of_these_tests_breaks_and_flows) {
    Graph graph = scene();
    const auto value = graph.evaluate("sim", "state", 10);
    ASSERT_TRUE(value);
    const FrameState& s = *std::get<std::shared_ptr<const StateValue>>(*value)->state;
    EXPECT_LT(std::count(s.edge_intact.begin(), s.edge_intact.end(), 1), static_cast<long>(s.edge_intact.size()));
    double flow = 0;
    for (const Mat3& f : s.plastic_deformation) flow = std::max(flow, (f - Mat3::Identity()).norm());
    EXPECT_GT(flow, 1e-3);
}

TEST(Bake, states_on_disk_are_the_states_that_were_evaluated) {
    TemporaryFolder folder;
    Graph graph = scene();
    ASSERT_TRUE(bake(graph, settings(folder / "b")));
    for (int frame : {1, 5, 10}) {
        const auto file = read_state_file(
            (folder / ("b/state/sim." + std::string(frame < 10 ? "000" : "00") + std::to_string(frame) + ".ply"))
                .string());
        ASSERT_TRUE(file) << file.error().text();
        const auto value = graph.evaluate("sim", "state", frame);
        EXPECT_EQ(state_hash(file->state), state_hash(*std::get<std::shared_ptr<const StateValue>>(*value)->state));
    }
}

TEST_P(Bake, cancelled_at_any_time_leaves_whole_frames_and_goes_on) {
    TemporaryFolder folder;
    Graph whole = scene(GetParam());
    int n_calls = 0;
    const Progress::Callback count = [&](double, std::string_view) { return ++n_calls > 0; };
    ASSERT_TRUE(bake(whole, settings(folder / "whole"), Progress(count)));
    ASSERT_GT(n_calls, 40);  // several a frame, so that these times lie in different stages
    for (int calls : {0, 3, n_calls / 2, n_calls / 2 + 1, n_calls / 2 + 2, n_calls - 2}) {
        const auto path = folder / ("c" + std::to_string(calls));
        Graph graph = scene(GetParam());
        int left = calls;
        const Progress::Callback stop = [&](double, std::string_view) { return left-- > 0; };
        const auto cancelled = bake(graph, settings(path), Progress(stop));
        ASSERT_FALSE(cancelled);
        EXPECT_EQ(cancelled.error().code, ErrorCode::cancelled);
        const auto manifest = read_manifest(path);
        ASSERT_TRUE(manifest);
        EXPECT_LT(manifest->frames.size(), 10u);
        for (const auto& [name, bytes] : contents(path)) EXPECT_FALSE(name.ends_with(kTemporarySuffix)) << name;
        Graph again = scene(GetParam());
        ASSERT_TRUE(bake(again, settings(path, BakeStart::resume)));
        EXPECT_EQ(contents(path), contents(folder / "whole"));
    }
}

TEST(Bake, progress_never_runs_backwards) {
    TemporaryFolder folder;
    Graph graph = scene();
    double last = 0;
    const Progress::Callback watch = [&](double fraction, std::string_view) {
        EXPECT_GE(fraction, last - 1e-12);
        EXPECT_LE(fraction, 1 + 1e-12);
        last = fraction;
        return true;
    };
    ASSERT_TRUE(bake(graph, settings(folder / "b"), Progress(watch)));
    EXPECT_EQ(last, 1);
}

TEST(Bake, a_killed_frame_s_leftovers_are_overwritten) {
    TemporaryFolder folder;
    Graph whole = scene();
    ASSERT_TRUE(bake(whole, settings(folder / "whole")));
    Graph first = scene();
    ASSERT_TRUE(bake(first, settings(folder / "b", BakeStart::fresh, {{1, 4}})));
    // Killed after it renamed one file of frame 5 and while it wrote the other.
    spill(folder / "b/mesh/block.005.obj", slurp(folder / "whole/mesh/block.005.obj"));
    spill(folder / ("b/state/sim.0005.ply" + std::string(kTemporarySuffix)), "half");
    Graph second = scene();
    const auto rest = bake(second, settings(folder / "b", BakeStart::resume));
    ASSERT_TRUE(rest) << rest.error().text();
    EXPECT_EQ(contents(folder / "b"), contents(folder / "whole"));
}

TEST(Bake, an_earlier_bake_is_not_lost_by_accident) {
    TemporaryFolder folder;
    Graph graph = scene();
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::fresh, {{1, 3}})));
    const auto before = contents(folder / "b");
    const Error error = refused(bake(graph, settings(folder / "b")));
    EXPECT_EQ(error.code, ErrorCode::bad_input);
    EXPECT_TRUE(has(error.text(), "--resume") && has(error.text(), "--restart"));
    ASSERT_TRUE(graph.set("clay", "density", 900));
    const Error other = refused(bake(graph, settings(folder / "b", BakeStart::resume)));
    EXPECT_TRUE(has(other.text(), "'clay', 'density': 1000.0 was baked, now 900.0")) << other.text();
    EXPECT_EQ(contents(folder / "b"), before);
}

TEST(Bake, restart_removes_what_it_wrote_and_nothing_else) {
    TemporaryFolder folder;
    Graph graph = scene();
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::fresh, {{1, 6}})));
    spill(folder / "b/notes.txt", "mine");
    spill(folder / "b/mesh/notes.txt", "mine too");
    ASSERT_TRUE(graph.set("out", "path", "other/block.####.ply"));
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::restart, {{1, 2}})));
    std::set<std::string> names;
    for (const auto& [name, unused] : contents(folder / "b")) names.insert(name);
    EXPECT_EQ(names, (std::set<std::string>{".sunder/sim.even.loads.json", "breaks/sim.0002.json", "manifest.json",
                                            "mesh/notes.txt", "notes.txt", "other/block.0001.ply",
                                            "other/block.0002.ply", "state/sim.0001.ply", "state/sim.0002.ply"}));
}

TEST(Bake, a_restart_that_is_refused_loses_nothing) {
    TemporaryFolder folder;
    Graph graph = scene();
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::fresh, {{1, 3}})));
    const auto whole = contents(folder / "b");
    const auto restart = [&] { return refused(bake(graph, settings(folder / "b", BakeStart::restart, {{1, 3}}))); };
    // A graph that is found to be bad only when it is evaluated.
    ASSERT_TRUE(graph.add_node("hold", "pin"));
    ASSERT_TRUE(graph.set("hold", "body", "@clay.body"));
    ASSERT_TRUE(graph.set("hold", "box_min", {5, 5, 5}));
    ASSERT_TRUE(graph.set("hold", "box_max", {6, 6, 6}));
    ASSERT_TRUE(graph.set("sim", "pins", {"@hold.pin"}));
    EXPECT_EQ(restart().parameter, "region") << "nothing in it";
    EXPECT_EQ(contents(folder / "b"), whole);
    ASSERT_TRUE(graph.remove_node("hold"));
    // A file that somebody else put in the place of a frame.
    const std::string frame = slurp(folder / "b/state/sim.0002.ply");
    spill(folder / "b/state/sim.0002.ply", "mine");
    auto with_mine = whole;
    with_mine["state/sim.0002.ply"] = "mine";
    EXPECT_TRUE(has(restart().text(), "sim.0002.ply: is there already"));
    EXPECT_EQ(contents(folder / "b"), with_mine);
    spill(folder / "b/state/sim.0002.ply", frame);
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::restart, {{1, 3}})));
    EXPECT_EQ(contents(folder / "b"), whole);
}

// As of a bake that was killed when a frame's first files were there and its manifest was not.
TEST(Bake, frames_that_no_manifest_lists_yet_do_not_hinder_resuming) {
    for (const char* compression : {"none", "zstd"}) {
        TemporaryFolder folder;
        const auto begin = [&] {
            Graph graph = scene();
            for (const char* node : {"out", "cache"}) EXPECT_TRUE(graph.set(node, "compression", compression));
            return graph;
        };
        Graph whole = begin(), stopped = begin(), resumed = begin();
        ASSERT_TRUE(bake(whole, settings(folder / "whole")));
        ASSERT_TRUE(bake(stopped, settings(folder / "b", BakeStart::fresh, {{1, 4}})));
        const auto wanted = contents(folder / "whole");
        size_t n = 0;
        for (const auto& [path, bytes] : wanted)
            if (has(path, "005.")) spill(folder / "b" / path, bytes), ++n;
        ASSERT_EQ(n, 3u);  // mesh, state, and what broke
        const auto rest = bake(resumed, settings(folder / "b", BakeStart::resume));
        ASSERT_TRUE(rest) << compression << ": " << rest.error().text();
        EXPECT_EQ(contents(folder / "b"), wanted) << compression;
    }
}

TEST(Bake, restart_mends_a_manifest_that_was_cut_off) {
    TemporaryFolder folder;
    Graph graph = scene();
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::fresh, {{1, 2}})));
    const std::string manifest = slurp(folder / "b/manifest.json");
    spill(folder / "b/manifest.json", manifest.substr(0, manifest.size() / 2));
    EXPECT_EQ(refused(bake(graph, settings(folder / "b", BakeStart::resume))).code, ErrorCode::bad_input);
    const auto report = bake(graph, settings(folder / "b", BakeStart::restart, {{1, 2}}));
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_EQ(slurp(folder / "b/manifest.json"), manifest);
}

TEST(Bake, a_manifest_that_names_a_stranger_s_file_does_not_get_it_removed) {
    TemporaryFolder folder;
    Graph graph = scene();
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::fresh, {{1, 1}})));
    spill(folder / "b/notes.txt", "mine");
    auto manifest = read_manifest(folder / "b");
    ASSERT_TRUE(manifest);
    manifest->frames[0].files[0].path = "notes.txt";
    spill(folder / "b/manifest.json", to_json(*manifest).dump(1));
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::restart, {{1, 1}})));
    EXPECT_EQ(slurp(folder / "b/notes.txt"), "mine");
}

TEST(Bake, a_manifest_that_lies_is_not_resumed) {
    TemporaryFolder folder;
    Graph graph = scene();
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::fresh, {{1, 3}})));
    const auto state = folder / "b/state/sim.0002.ply";
    const std::string bytes = slurp(state);
    const auto resume = [&] { return refused(bake(graph, settings(folder / "b", BakeStart::resume))); };
    spill(state, bytes.substr(0, bytes.size() - 1));
    EXPECT_TRUE(has(resume().text(), "sim.0002.ply"));
    std::filesystem::remove(state);
    EXPECT_TRUE(has(resume().text(), "sim.0002.ply: no such file"));
    spill(state, bytes);
    std::string changed = slurp(folder / "b/state/sim.0003.ply");
    changed[changed.size() / 2] ^= 1;
    spill(folder / "b/state/sim.0003.ply", changed);
    EXPECT_TRUE(has(resume().text(), "sim.0003.ply: its contents have changed"));
}

TEST(Bake, foreign_files_are_not_replaced) {
    for (const char* name : {"mesh/block.007.obj", "state/sim.0001.ply", "manifest.json", ".sunder/x", "mesh"}) {
        TemporaryFolder folder;
        spill(folder / (std::string("b/") + name), "mine");
        Graph graph = scene();
        for (BakeStart start : {BakeStart::fresh, BakeStart::resume, BakeStart::restart}) {
            const Error error = refused(bake(graph, settings(folder / "b", start)));
            EXPECT_TRUE(error.code == ErrorCode::bad_input || error.code == ErrorCode::io) << error.text();
            EXPECT_TRUE(has(error.text(), "b/" + std::string(name).substr(0, 5))) << error.text();
        }
        EXPECT_EQ(contents(folder / "b"), (std::map<std::string, std::string>{{name, "mine"}})) << name;
    }
}

TEST(Bake, nothing_is_written_outside_through_a_link) {
    TemporaryFolder folder;
    std::filesystem::create_directories(folder / "elsewhere");
    std::filesystem::create_directories(folder / "b");
    std::filesystem::create_directory_symlink(folder / "elsewhere", folder / "b/mesh");
    Graph graph = scene();
    EXPECT_TRUE(has(refused(bake(graph, settings(folder / "b"))).text(), "link"));
    EXPECT_TRUE(std::filesystem::is_empty(folder / "elsewhere"));
}

TEST(Bake, what_cannot_be_baked_is_refused_before_a_folder_is_made) {
    TemporaryFolder folder;
    const auto refusal = [&](Graph& graph, std::optional<std::array<int, 2>> frames = {}) {
        const Error error = refused(bake(graph, settings(folder / "b", BakeStart::fresh, frames)));
        EXPECT_EQ(error.code, ErrorCode::bad_input) << error.text();
        EXPECT_FALSE(std::filesystem::exists(folder / "b"));
        return error;
    };
    Graph graph = scene();
    EXPECT_TRUE(has(refusal(graph, {{5, 2}}).text(), "reversed"));
    EXPECT_TRUE(has(refusal(graph, {{0, 2}}).text(), "frame 1"));
    EXPECT_TRUE(has(refusal(graph, {{1, 2'000'000}}).text(), "1000000"));
    ASSERT_TRUE(graph.set("cache", "path", "state/sim.####.obj"));
    Error error = refusal(graph);
    EXPECT_EQ(error.node, "cache");
    EXPECT_EQ(error.parameter, "path");
    ASSERT_TRUE(graph.set("cache", "path", ".sunder/sim.####.ply"));
    EXPECT_EQ(refusal(graph).node, "cache");
    ASSERT_TRUE(graph.set("out", "path", "same.#.ply"));
    ASSERT_TRUE(graph.set("cache", "path", "same.#.ply"));
    EXPECT_TRUE(has(refusal(graph).text(), "same.1.ply"));
    ASSERT_TRUE(graph.remove_node("out"));
    ASSERT_TRUE(graph.remove_node("cache"));
    EXPECT_TRUE(has(refusal(graph).text(), "bake_mesh"));
}

TEST(Bake, a_full_disk_ends_it_with_whole_frames_and_it_goes_on_later) {
    TemporaryFolder folder;
    Graph whole = scene();
    ASSERT_TRUE(bake(whole, settings(folder / "whole")));
    Graph graph = scene();
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::fresh, {{1, 2}})));
    rlimit old_limit{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
    const auto old_handler = signal(SIGXFSZ, SIG_IGN);
    rlimit limit = old_limit;
    limit.rlim_cur = 2000;  // bytes; less than any state frame
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
    const auto full = bake(graph, settings(folder / "b", BakeStart::resume));
    setrlimit(RLIMIT_FSIZE, &old_limit);
    signal(SIGXFSZ, old_handler);
    EXPECT_EQ(refused(full).code, ErrorCode::io);
    EXPECT_EQ(read_manifest(folder / "b")->frames.size(), 2u);
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::resume)));
    EXPECT_EQ(contents(folder / "b"), contents(folder / "whole"));
}

TEST(Bake, two_bakes_do_not_share_a_folder) {
    TemporaryFolder folder;
    const auto held = BakeFolder::open(folder / "b");
    ASSERT_TRUE(held);
    Graph graph = scene();
    EXPECT_TRUE(has(refused(bake(graph, settings(folder / "b"))).text(), "another bake"));
}

TEST(Bake, what_a_solver_leaves_out_is_noted) {
    TemporaryFolder folder;
    Graph graph = scene();
    ASSERT_TRUE(graph.set("block", "cells", Json::array({3, 3, 1})));
    EXPECT_TRUE(bake(graph, settings(folder / "projective"))->notes.empty());
    ASSERT_TRUE(graph.set("sim", "method", "jacobi"));
    const auto report = bake(graph, settings(folder / "jacobi"));
    ASSERT_TRUE(report);
    ASSERT_EQ(report->notes.size(), 1u);
    EXPECT_TRUE(has(report->notes[0], "node 'sim': body 'clay': 9 fragments of sheets, rods or slender bodies"))
        << report->notes[0];
}

TEST(Bake, frames_may_begin_after_the_simulation_does) {
    TemporaryFolder folder;
    Graph whole = scene();
    ASSERT_TRUE(bake(whole, settings(folder / "whole")));
    Graph graph = scene();
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::fresh, {{6, 7}})));
    ASSERT_TRUE(bake(graph, settings(folder / "b", BakeStart::resume, {{6, 9}})));
    EXPECT_EQ(slurp(folder / "b/state/sim.0009.ply"), slurp(folder / "whole/state/sim.0009.ply"));
    EXPECT_TRUE(
        has(refused(bake(graph, settings(folder / "b", BakeStart::resume, {{5, 9}}))).text(), "began at frame 6"));
    const auto nothing = bake(graph, settings(folder / "b", BakeStart::resume, {{6, 7}}));
    ASSERT_TRUE(nothing);
    EXPECT_EQ(nothing->n_frames, 0u);
    EXPECT_EQ(read_manifest(folder / "b")->frames.size(), 4u);
}

}  // namespace
}  // namespace sunder
