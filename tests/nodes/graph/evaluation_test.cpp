#include "nodes/graph/evaluation.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/nodes/number_nodes.h"

namespace sunder {
namespace {

using number_nodes::chain;
using number_nodes::drag;

std::vector<size_t> cooks(const Graph& graph) {
    return {graph.cook_count("a"), graph.cook_count("b"), graph.cook_count("total"), graph.cook_count("out")};
}

using Counts = std::vector<size_t>;

TEST(Evaluation, cooks_nothing_twice_that_no_edit_touched) {
    Graph graph = chain();
    EXPECT_EQ(drag(graph.evaluate("out", "force", 1)), 2);
    EXPECT_EQ(drag(graph.evaluate("out", "force", 7)), 2);  // nothing is animated: every frame is the same
    EXPECT_EQ(cooks(graph), (Counts{1, 1, 1, 1}));
    ASSERT_TRUE(graph.set("b", "value", 4));
    EXPECT_EQ(drag(graph.evaluate("out", "force", 1)), 5);
    EXPECT_EQ(cooks(graph), (Counts{1, 2, 2, 2}));
    ASSERT_TRUE(graph.set("out", "factor", 2));
    EXPECT_EQ(drag(graph.evaluate("out", "force", 1)), 10);
    EXPECT_EQ(cooks(graph), (Counts{1, 2, 2, 3}));
    ASSERT_TRUE(graph.set("b", "value", 4.0));  // the same value again
    EXPECT_EQ(drag(graph.evaluate("out", "force", 1)), 10);
    EXPECT_EQ(cooks(graph), (Counts{1, 2, 2, 3}));
}

TEST(Evaluation, follows_wires_as_they_change) {
    Graph graph = chain();
    EXPECT_EQ(drag(graph.evaluate("out", "force", 1)), 2);
    ASSERT_TRUE(graph.set("total", "terms", {"@b.force"}));
    EXPECT_EQ(drag(graph.evaluate("out", "force", 1)), 1);
    ASSERT_TRUE(graph.remove_node("a"));
    EXPECT_EQ(drag(graph.evaluate("out", "force", 1)), 1);
}

TEST(Evaluation, animated_values_differ_by_frame_and_only_what_depends_on_them) {
    Graph graph = chain();
    ASSERT_TRUE(graph.set("a", "value", {{"keys", {{1, 0}, {11, 10}}}}));
    for (const int frame : {1, 3, 11, 3}) EXPECT_EQ(drag(graph.evaluate("out", "force", frame)), frame) << frame;
    EXPECT_EQ(graph.cook_count("b"), 1u);
    EXPECT_EQ(graph.cook_count("a"), 3u);  // frames 1, 3, 11; the two latest are kept
}

TEST(Evaluation, keys_tell_what_was_edited_from_what_follows) {
    Graph graph = chain();
    const auto own = graph.own_keys(), all = graph.keys();
    ASSERT_TRUE(graph.set("b", "value", 4));
    const auto own_after = graph.own_keys(), all_after = graph.keys();
    EXPECT_EQ(own.at("a"), own_after.at("a"));
    EXPECT_NE(own.at("b"), own_after.at("b"));
    EXPECT_EQ(own.at("total"), own_after.at("total"));
    EXPECT_EQ(all.at("a"), all_after.at("a"));
    for (const char* name : {"b", "total", "out"}) EXPECT_NE(all.at(name), all_after.at(name)) << name;
    ASSERT_TRUE(graph.set("b", "value", 1));
    EXPECT_EQ(graph.keys(), all);
}

TEST(Evaluation, a_default_written_out_has_the_key_of_one_left_out) {
    Graph graph = chain();
    const auto before = graph.keys();
    ASSERT_TRUE(graph.set("a", "value", 1));
    EXPECT_EQ(graph.keys(), before);
}

TEST(Evaluation, keys_see_the_content_of_files) {
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "sunder_key_test.txt";
    Graph graph = chain();
    std::filesystem::remove(file);
    ASSERT_TRUE(graph.set("a", "file", file.string()));
    const ContentKey missing = graph.keys().at("out");
    std::ofstream(file) << "one";
    const ContentKey one = graph.keys().at("out");
    std::ofstream(file) << "three";
    const ContentKey three = graph.keys().at("out");
    std::ofstream(file) << "one";
    std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now() + std::chrono::hours(1));
    EXPECT_NE(missing, one);
    EXPECT_NE(one, three);
    EXPECT_EQ(graph.keys().at("out"), one) << "the content counts, not when it was written";
    std::filesystem::remove(file);
}

TEST(Evaluation, errors_name_the_node_that_failed_not_the_one_asked_for) {
    Graph graph = chain();
    ASSERT_TRUE(graph.set("total", "factor", 1e6));
    const Result<Value> value = graph.evaluate("out", "force", 1);
    ASSERT_FALSE(value);
    EXPECT_EQ(value.error().node, "total");
    EXPECT_EQ(value.error().where, "node 'total'");
    ASSERT_TRUE(graph.set("total", "factor", 1));
    EXPECT_TRUE(graph.evaluate("out", "force", 1)) << "a failure is not kept";
}

TEST(Evaluation, frames_far_beyond_any_shot_are_refused) {
    Graph graph = chain();
    EXPECT_FALSE(graph.evaluate("out", "force", 2147483647));
    EXPECT_FALSE(graph.evaluate("out", "force", -2147483648));
}

TEST(Evaluation, only_solvers_take_saved_states) {
    Graph graph = chain();
    const Status status = graph.seed_state("out", 1, FrameState{});
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::bad_input);
}

}  // namespace
}  // namespace sunder
