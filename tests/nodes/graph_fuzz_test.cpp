// Graph files come from people, exporters and broken disks: whatever they hold, reading them ends in a graph or a
// refusal.
#include <gtest/gtest.h>

#include <random>

#include "nodes/graph/graph.h"
#include "nodes/graph/json.h"

namespace sunder {
namespace {

constexpr const char* kText = R"({ "sunder": 1, "frame_rate": 24, "frame_range": [1, 96], "nodes": {
  "bar":    {"type": "lattice", "size": [0.2, 0.2, 1.0], "cells": [4, 4, 20], "neighbours": 6},
  "rubber": {"type": "body", "fragments": "@bar.fragments", "yield": null, "toughness": {"keys": [[1, 0.5], [9, 2e-1]]}},
  "head":   {"type": "pin", "body": "@rubber.body", "rotation": {"keys": [[1, [0, 0, 0]], [48, [0, 0, 90]]]}, "release_frame": null},
  "file":   {"type": "mesh_file", "path": "a.obj", "groups": {"ears": [1, 2, 3]}},
  "sim":    {"type": "solver", "bodies": ["@rubber.body"], "pins": ["@head.pin"], "gravity": [0, 0, 0], "self_collision": false},
  "out":    {"type": "bake_state", "state": "@sim.state", "path": "state/sim.####.ply"} } })";

/// Whatever is read can be written and read again as the same; whatever is refused says why.
void expect_graph_or_refusal(const std::string& text, size_t& io_read) {
    Result<Graph> graph = Graph::from_json_text(text, "fuzz", "");
    if (!graph) {
        EXPECT_EQ(graph.error().code, ErrorCode::bad_input) << text;
        EXPECT_FALSE(graph.error().what.empty()) << text;
        return;
    }
    ++io_read;
    const std::string written = graph->to_json().dump();
    Result<Graph> again = Graph::from_json_text(written, "again", "");
    ASSERT_TRUE(again) << again.error().text() << "\n" << written;
    EXPECT_EQ(again->to_json().dump(), written);
    EXPECT_EQ(again->keys(), graph->keys());
}

TEST(GraphFuzz, bytes_that_went_wrong) {
    std::mt19937 random(7);
    const std::string whole = kText;
    constexpr std::string_view kLikely("{}[],:\"@.#-+eE0123456789 \n\\\x00\xff", 29);
    size_t read = 0;
    for (int round = 0; round < 1500; ++round) {
        std::string text = whole;
        for (uint32_t n = 1 + random() % 3; n > 0; --n) {
            const size_t at = random() % text.size();
            switch (random() % 4) {
                case 0:
                    text[at] = kLikely[random() % kLikely.size()];
                    break;
                case 1:
                    text.erase(at, 1 + random() % 5);
                    break;
                case 2:
                    text.insert(at, 1, kLikely[random() % kLikely.size()]);
                    break;
                default:
                    text.insert(at, text.substr(random() % text.size(), random() % 30));
            }
        }
        expect_graph_or_refusal(text, read);
    }
    EXPECT_GT(read, 10u) << "some faults are harmless, so that the reader is walked to its end";
}

/// Every value of a document, by the path to it.
void collect(Json& json, std::vector<Json*>& out_values) {
    out_values.push_back(&json);
    for (Json& child : json)
        if (json.is_structured()) collect(child, out_values);
}

TEST(GraphFuzz, values_of_other_kinds) {
    std::mt19937 random(11);
    const std::vector<Json> foreign = {nullptr,
                                       true,
                                       0,
                                       -1,
                                       1e308,
                                       -1e-308,
                                       2147483648u,
                                       18446744073709551615u,
                                       "",
                                       "@",
                                       "@.",
                                       "@bar.",
                                       "@bar.fragments",
                                       "@sim.state",
                                       "####",
                                       Json::array(),
                                       Json::object(),
                                       {1, 2, 3},
                                       {{"keys", {1}}},
                                       {{"keys", {{1, nullptr}}}},
                                       Json::array({Json::array({Json::array()})})};
    size_t read = 0;
    for (int round = 0; round < 3000; ++round) {
        Json document = Json::parse(kText);
        std::vector<Json*> values;
        collect(document, values);
        *values[random() % values.size()] = foreign[random() % foreign.size()];
        expect_graph_or_refusal(document.dump(), read);
    }
    EXPECT_GT(read, 10u);
}

}  // namespace
}  // namespace sunder
