// Real graphs through the solver node: what is simulated, what is not simulated again, and what is refused.
#include <gtest/gtest.h>

#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"
#include "solver/data/rotations.h"
#include "solver/presets.h"

namespace sunder {
namespace {

/// A small lattice block falls on the floor.
constexpr const char* kFall = R"({ "sunder": 1, "frame_rate": 24, "frame_range": [1, 20],
  "nodes": {
    "cells": {"type": "lattice", "size": [0.4, 0.4, 0.4], "cells": [2, 2, 2], "center": [0, 0, 0.2]},
    "block": {"type": "body", "fragments": "@cells.fragments", "position": [0, 0, 0.5], "youngs_modulus": 1e5},
    "floor": {"type": "collider", "shape": "plane"},
    "sim":   {"type": "solver", "bodies": ["@block.body"], "colliders": ["@floor.collider"], "damping": 1.0},
    "skin":  {"type": "deformer", "body": "@block.body", "state": "@sim.state"},
    "out":   {"type": "bake_state", "state": "@sim.state", "path": "state/sim.####.ply"} } })";

using StatePtr = std::shared_ptr<const StateValue>;

/// A graph that notes which frames are really simulated.
class Shot {
public:
    explicit Shot(const char* text = kFall) : graph_(read(text)) {}

    Graph& graph() { return graph_; }
    void set(const std::string& node, const std::string& name, const Json& value) {
        const Status status = graph_.set(node, name, value);
        ASSERT_TRUE(status) << status.error().text();
    }
    StatePtr state(int frame) {
        simulated.clear();
        const Result<Value> value = graph_.evaluate("sim", "state", frame, Progress(note_));
        EXPECT_TRUE(value) << value.error().text();
        return value ? std::get<StatePtr>(*value) : nullptr;
    }
    uint64_t hash(int frame) { return state_hash(*state(frame)->state); }
    Error fault(const std::string& node, const std::string& socket, int frame) {
        const Result<Value> value = graph_.evaluate(node, socket, frame);
        EXPECT_FALSE(value);
        return value ? Error{} : value.error();
    }

    std::vector<int> simulated;  // by the latest call of state()

private:
    static Graph read(const char* text) {
        Result<Graph> graph = Graph::from_json_text(text, "shot", "");
        EXPECT_TRUE(graph) << graph.error().text();
        EXPECT_TRUE(graph->set_threads(1));
        return graph.take();
    }

    Graph graph_;
    Progress::Callback note_ = [this](double, std::string_view text) {
        constexpr std::string_view kStart = "simulating frame ";
        if (!text.starts_with(kStart)) return true;
        const int frame = std::stoi(std::string(text.substr(kStart.size())));
        if (simulated.empty() || simulated.back() != frame) simulated.push_back(frame);
        return true;
    };
};

using Frames = std::vector<int>;

TEST(SolverNode, a_block_falls_on_the_floor_and_rests_there) {
    Shot shot;
    ASSERT_TRUE(shot.graph().set_frame_range(1, 60));
    const auto lowest = [](const StateValue& s) {
        double z = 1e9;
        for (const Vec3& p : s.state->position) z = std::min(z, p.z());
        return z;
    };
    EXPECT_NEAR(lowest(*shot.state(1)), 0.6, 1e-12);
    EXPECT_LT(lowest(*shot.state(5)),
              0.6 - 0.5 * 9.81 * 0.15 * 0.15 * 0.8);  // four frames of falling, less a little damping
    const StatePtr end = shot.state(60);
    EXPECT_GT(lowest(*end), 0.0) << "no centre goes through the floor";
    EXPECT_LT(lowest(*end), 0.2);
    EXPECT_EQ(end->scene->bodies.size(), 1u);
    EXPECT_EQ(end->state->position.size(), 8u);
}

TEST(SolverNode, no_frame_is_simulated_twice) {
    Shot shot;
    shot.state(3);
    EXPECT_EQ(shot.simulated, (Frames{2, 3}));
    const StatePtr fifth = shot.state(5);
    EXPECT_EQ(shot.simulated, (Frames{4, 5}));
    shot.state(2);
    EXPECT_EQ(shot.simulated, Frames{});
    EXPECT_EQ(shot.state(5)->state, fifth->state) << "the very same state";
    EXPECT_EQ(shot.simulated, Frames{});
}

TEST(SolverNode, frames_before_the_start_are_the_start) {
    Shot shot;
    EXPECT_EQ(shot.state(-10)->state, shot.state(1)->state);
    EXPECT_EQ(shot.state(-10)->frame, 1);
    EXPECT_EQ(shot.simulated, Frames{});
}

TEST(SolverNode, the_order_in_which_frames_are_asked_for_changes_no_bit) {
    Shot forward, leaping;
    const uint64_t last = leaping.hash(12), middle = leaping.hash(6);
    for (int f = 1; f <= 12; ++f) {
        const uint64_t hash = forward.hash(f);
        EXPECT_TRUE(f != 6 || hash == middle);
        EXPECT_TRUE(f != 12 || hash == last);
    }
}

TEST(SolverNode, edits_downstream_do_not_simulate_again) {
    Shot shot;
    shot.state(5);
    shot.set("skin", "topology", "compact");
    shot.set("out", "path", "other/sim.####.ply");
    ASSERT_TRUE(shot.graph().remove_node("skin"));
    ASSERT_TRUE(shot.graph().set_frame_range(1, 500));
    shot.state(5);
    EXPECT_EQ(shot.simulated, Frames{});
}

TEST(SolverNode, an_animated_edit_costs_the_frames_that_it_changes) {
    Shot shot;
    shot.set("block", "youngs_modulus", {{"keys", {{1, 1e5}, {6, 1e5}, {10, 2e5}}}});
    shot.state(12);
    shot.set("block", "youngs_modulus", {{"keys", {{1, 1e5}, {6, 1e5}, {10, 3e5}}}});
    const uint64_t after = shot.hash(12);
    EXPECT_EQ(shot.simulated, (Frames{7, 8, 9, 10, 11, 12}));
    Shot fresh;
    fresh.set("block", "youngs_modulus", {{"keys", {{1, 1e5}, {6, 1e5}, {10, 3e5}}}});
    EXPECT_EQ(fresh.hash(12), after);
}

TEST(SolverNode, every_input_that_matters_simulates_again) {
    const std::vector<std::tuple<std::string, std::string, Json>> edits = {{"cells", "cells", {2, 2, 3}},
                                                                           {"block", "position", {0, 0, 0.6}},
                                                                           {"block", "density", 900},
                                                                           {"block", "velocity", {0, 0, -1}},
                                                                           {"block", "angular_velocity", {0, 90, 0}},
                                                                           {"block", "youngs_modulus", 2e5},
                                                                           {"block", "yield", 0.01},
                                                                           {"block", "friction", 0.9},
                                                                           {"floor", "position", {0, 0, -0.1}},
                                                                           {"floor", "friction", 0.1},
                                                                           {"sim", "substeps", 4},
                                                                           {"sim", "iterations", 3},
                                                                           {"sim", "preset", "preview"},
                                                                           {"sim", "error_budget", 0.05},
                                                                           {"sim", "gravity", {0, 0, -5}},
                                                                           {"sim", "damping", 2.0},
                                                                           {"sim", "self_collision", false},
                                                                           {"sim", "sleeping", false},
                                                                           {"sim", "colliders", Json::array()}};
    for (const auto& [node, parameter, value] : edits) {
        Shot shot;
        shot.state(3);
        shot.set(node, parameter, value);
        shot.state(3);
        EXPECT_EQ(shot.simulated, (Frames{2, 3})) << node << "." << parameter;
    }
    Shot rate;
    rate.state(3);
    ASSERT_TRUE(rate.graph().set_frame_rate(30));
    rate.state(3);
    EXPECT_EQ(rate.simulated, (Frames{2, 3}));
}

TEST(SolverNode, a_preset_gives_the_steps_that_are_not_given) {
    for (const Preset& preset : kPresets) {
        Shot by_name, by_numbers, mixed, mixed_numbers;
        by_name.set("sim", "preset", std::string(preset.name));
        by_numbers.set("sim", "substeps", preset.substeps);
        by_numbers.set("sim", "iterations", preset.iterations);
        by_numbers.set("sim", "hit_substeps", preset.hit_substeps);
        EXPECT_EQ(by_name.hash(10), by_numbers.hash(10)) << preset.name;
        mixed.set("sim", "preset", std::string(preset.name));
        mixed.set("sim", "substeps", 5);
        mixed_numbers.set("sim", "substeps", 5);
        mixed_numbers.set("sim", "iterations", preset.iterations);
        mixed_numbers.set("sim", "hit_substeps", preset.hit_substeps);
        EXPECT_EQ(mixed.hash(10), mixed_numbers.hash(10)) << preset.name;
    }
}

TEST(SolverNode, an_error_budget_chooses_the_steps) {
    Shot shot;
    shot.set("sim", "error_budget", 0.02);
    EXPECT_EQ(shot.state(3)->report.substeps, 1);  // falling
    int most = 0;
    for (int frame = 4; frame <= 20; ++frame) most = std::max(most, shot.state(frame)->report.substeps);
    EXPECT_GT(most, 8);  // the floor
}

TEST(SolverNode, scaled_time_simulates_each_grid_point_once_and_keeps_its_bits) {
    Shot plain, slow;
    slow.set("sim", "time_scale", 0.25);
    for (int frame = 1; frame <= 20; ++frame) {
        const StatePtr state = slow.state(frame);
        const int grid = 1 + (frame - 1) / 4, share = (frame - 1) % 4;
        // Frame 2 is the first that needs point 2, frame 6 the first that needs point 3.
        EXPECT_EQ(slow.simulated, share == 1 ? Frames{grid + 1} : Frames{}) << frame;
        EXPECT_EQ(state->at.frame, 1 + (frame - 1) / 4.0);
        EXPECT_EQ(state_hash(*state->kept), plain.hash(grid)) << frame;
        EXPECT_EQ(state->state == state->kept, share == 0) << frame;
    }
    // A cache with hardly any room changes nothing but the time it takes.
    Shot narrow;
    narrow.graph().set_cache_limit(1);
    narrow.set("sim", "time_scale", 0.25);
    for (int frame : {20, 3, 19, 18, 2}) EXPECT_EQ(narrow.hash(frame), slow.hash(frame)) << frame;
}

TEST(SolverNode, threads_change_nothing) {
    Shot shot;
    const uint64_t hash = shot.hash(6);
    ASSERT_TRUE(shot.graph().set_threads(2));
    EXPECT_EQ(shot.hash(6), hash);
    EXPECT_EQ(shot.simulated, Frames{});
    Shot other;
    ASSERT_TRUE(other.graph().set_threads(2));
    EXPECT_EQ(other.hash(6), hash);
}

TEST(SolverNode, a_seeded_frame_continues_with_the_same_bits) {
    Shot whole, resumed;
    const FrameState saved = *whole.state(4)->state;
    const uint64_t wanted = whole.hash(9);
    ASSERT_TRUE(resumed.graph().seed_state("sim", 4, saved));
    EXPECT_EQ(resumed.hash(9), wanted);
    EXPECT_EQ(resumed.simulated, (Frames{5, 6, 7, 8, 9}));
    EXPECT_EQ(resumed.hash(2), whole.hash(2));
}

TEST(SolverNode, refuses_states_of_another_scene) {
    Shot shot;
    FrameState state = *shot.state(2)->state;
    EXPECT_FALSE(shot.graph().seed_state("sim", 0, state)) << "before the first frame";
    state.position.pop_back();
    const Status status = shot.graph().seed_state("sim", 2, state);
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().node, "sim");
    EXPECT_FALSE(shot.graph().seed_state("block", 2, state));
}

TEST(SolverNode, a_small_cache_gives_the_same_bits) {
    Shot large, small;
    small.graph().set_cache_limit(20000);
    for (const int f : {15, 7, 11, 14, 3}) EXPECT_EQ(small.hash(f), large.hash(f)) << f;
}

TEST(SolverNode, cancelling_keeps_what_was_simulated) {
    Shot shot;
    Progress::Callback stop = [](double, std::string_view text) { return text != "simulating frame 5"; };
    const Result<Value> value = shot.graph().evaluate("sim", "state", 9, Progress(stop));
    ASSERT_FALSE(value);
    EXPECT_EQ(value.error().code, ErrorCode::cancelled);
    shot.state(9);
    EXPECT_EQ(shot.simulated, (Frames{5, 6, 7, 8, 9}));
}

TEST(SolverNode, two_bodies_of_one_cut_have_slices_of_their_own) {
    Shot shot;
    ASSERT_TRUE(shot.graph().add_node("twin", "body"));
    shot.set("twin", "fragments", "@cells.fragments");
    shot.set("twin", "position", {2, 0, 1});
    shot.set("sim", "bodies", {"@twin.body", "@block.body"});
    const StatePtr state = shot.state(2);
    ASSERT_EQ(state->scene->bodies.size(), 2u);
    EXPECT_EQ(state->scene->bodies[1].name, "block");
    EXPECT_EQ(state->scene->bodies[1].particle_begin, 8u);
    const Result<Value> mesh = shot.graph().evaluate("skin", "mesh", 2);
    ASSERT_TRUE(mesh) << mesh.error().text();
    const auto& skin = *std::get<std::shared_ptr<const BodyMesh>>(*mesh);
    EXPECT_EQ(skin.body, "block");
    for (const Vec3f& p : skin.mesh.positions) EXPECT_LT(p.x(), 1.0f) << "the twin's slice was skinned";
}

TEST(SolverNode, bodies_and_pins_of_other_solvers_are_refused) {
    Shot shot;
    ASSERT_TRUE(shot.graph().add_node("other", "body"));
    shot.set("other", "fragments", "@cells.fragments");
    shot.set("skin", "body", "@other.body");
    const Error skin = shot.fault("skin", "mesh", 1);
    EXPECT_EQ(skin.node, "skin");
    EXPECT_NE(skin.text().find("does not move body 'other'"), std::string::npos) << skin.text();
    ASSERT_TRUE(shot.graph().add_node("hold", "pin"));
    shot.set("hold", "body", "@other.body");
    shot.set("sim", "pins", {"@hold.pin"});
    const Error pin = shot.fault("sim", "state", 1);
    EXPECT_EQ(pin.parameter, "pins");
    EXPECT_NE(pin.text().find("holds body 'other'"), std::string::npos) << pin.text();
}

TEST(SolverNode, pins_hold_what_lies_in_their_region_as_placed_and_move_it) {
    Shot shot;
    ASSERT_TRUE(shot.graph().add_node("hold", "pin"));
    shot.set("hold", "body", "@block.body");
    shot.set("hold", "box_min", {-1, -1, 0.7});  // the upper four: cells 0.4 high, put 0.5 up
    shot.set("hold", "box_max", {1, 1, 2});
    shot.set("hold", "pivot", {0, 0, 0.8});
    shot.set("hold", "rotation", {{"keys", {{1, {0, 0, 0}}, {5, {0, 0, 90}}}}});
    shot.set("hold", "release_frame", 5);
    shot.set("sim", "pins", {"@hold.pin"});
    const StatePtr start = shot.state(1), turned = shot.state(5), released = shot.state(12);
    ASSERT_EQ(start->scene->pins[0].particles.size(), 4u);
    for (const uint32_t i : start->scene->pins[0].particles) {
        const Vec3 from = start->state->position[i], to = turned->state->position[i];
        EXPECT_NEAR((to - Vec3(-from.y(), from.x(), from.z())).norm(), 0, 1e-9) << "a quarter turn about z";
        EXPECT_LT(released->state->position[i].z(), from.z() - 0.05);
    }
}

TEST(SolverNode, pins_let_go_over_as_many_frames_as_they_are_told) {
    const auto fallen = [](int release_frames, int frame) {
        Shot shot;
        EXPECT_TRUE(shot.graph().add_node("hold", "pin"));
        shot.set("hold", "body", "@block.body");
        shot.set("hold", "box_min", {-1, -1, 0});
        shot.set("hold", "box_max", {1, 1, 2});
        shot.set("hold", "release_frame", 3);
        shot.set("hold", "release_frames", release_frames);
        shot.set("sim", "pins", {"@hold.pin"});
        return shot.state(1)->state->position[0].z() - shot.state(frame)->state->position[0].z();
    };
    EXPECT_NEAR(fallen(0, 3), 0, 1e-12);
    EXPECT_GT(fallen(0, 5), 0.01);
    EXPECT_LT(fallen(12, 5), 1e-3);  // of a spring that is 1e6 times as stiff as it is heavy, and slackens
    EXPECT_GT(fallen(12, 5), 0);
    EXPECT_GT(fallen(12, 20), 0.05);
}

TEST(SolverNode, hinges_hold_places_and_let_turn) {
    Shot shot;
    ASSERT_TRUE(shot.graph().add_node("hold", "pin"));
    shot.set("hold", "body", "@block.body");
    shot.set("hold", "box_min", {0, -1, 0.7});  // an upper edge: it swings down about it
    shot.set("hold", "box_max", {1, 1, 2});
    shot.set("hold", "hold", "position");
    shot.set("sim", "pins", {"@hold.pin"});
    const StatePtr start = shot.state(1), swung = shot.state(8);
    ASSERT_TRUE(start->scene->pins[0].turns_freely);
    ASSERT_EQ(start->scene->pins[0].particles.size(), 2u);
    for (const ParticleId i : start->scene->pins[0].particles) {
        EXPECT_EQ(start->state->position[i], swung->state->position[i]);
        EXPECT_GT(angle_between(start->state->orientation[i], swung->state->orientation[i]), 0.3);
    }
    // What another pin holds wholly does not turn, whichever comes first.
    ASSERT_TRUE(shot.graph().add_node("clamp", "pin"));
    shot.set("clamp", "body", "@block.body");
    shot.set("clamp", "box_min", {0, -1, 0.7});
    shot.set("clamp", "box_max", {1, 1, 2});
    for (const Json& pins : {Json{"@hold.pin", "@clamp.pin"}, Json{"@clamp.pin", "@hold.pin"}}) {
        shot.set("sim", "pins", pins);
        const StatePtr held = shot.state(8);
        for (const ParticleId i : held->scene->pins[0].particles)
            EXPECT_NEAR(angle_between(start->state->orientation[i], held->state->orientation[i]), 0, 1e-6);
    }
}

TEST(SolverNode, what_a_method_leaves_out_is_told) {
    Shot shot;
    ASSERT_TRUE(shot.graph().add_node("hold", "pin"));
    shot.set("hold", "body", "@block.body");
    shot.set("hold", "box_min", {-1, -1, 0.4});
    shot.set("hold", "box_max", {1, 1, 2});
    shot.set("hold", "hold", "position");
    shot.set("sim", "pins", {"@hold.pin"});
    shot.set("cells", "cells", {4, 4, 1});
    EXPECT_TRUE(shot.state(2)->warnings.empty());
    shot.set("sim", "method", "jacobi");
    const std::vector<std::string>& told = shot.state(2)->warnings;
    ASSERT_EQ(told.size(), 2u);
    EXPECT_NE(told[0].find("body 'block': 16 fragments of sheets, rods or slender bodies"), std::string::npos)
        << told[0];
    EXPECT_NE(told[1].find("pin 'hold' holds the pose"), std::string::npos) << told[1];
}

TEST(SolverNode, pins_without_particles_and_unknown_groups_are_refused) {
    Shot shot;
    ASSERT_TRUE(shot.graph().add_node("hold", "pin"));
    shot.set("hold", "body", "@block.body");
    shot.set("hold", "box_min", {5, 5, 5});
    EXPECT_EQ(shot.fault("hold", "pin", 1).parameter, "box_min") << "beyond box_max";
    shot.set("hold", "box_max", {6, 6, 6});
    EXPECT_EQ(shot.fault("hold", "pin", 1).parameter, "region") << "nothing in it";
    shot.set("hold", "region", "group");
    EXPECT_EQ(shot.fault("hold", "pin", 1).parameter, "group") << "no name";
    shot.set("hold", "group", "ears");
    EXPECT_NE(shot.fault("hold", "pin", 1).text().find("no vertex group 'ears'"), std::string::npos);
}

TEST(SolverNode, bake_nodes_name_the_file_of_each_frame) {
    Shot shot;
    const Result<Value> item = shot.graph().evaluate("out", "item", 4);
    ASSERT_TRUE(item);
    const auto& bake = *std::get<std::shared_ptr<const BakeItem>>(*item);
    EXPECT_EQ(bake.path, "state/sim.0004.ply");
    EXPECT_EQ(bake.state->state, shot.state(4)->state);
    EXPECT_FALSE(bake.mesh);
}

}  // namespace
}  // namespace sunder
