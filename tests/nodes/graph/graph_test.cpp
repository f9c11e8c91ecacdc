#include "nodes/graph/graph.h"

#include <gtest/gtest.h>

#include "nodes/graph/json.h"
#include "tests/nodes/number_nodes.h"

namespace sunder {
namespace {

using number_nodes::chain;

void expect_refused(const Status& status, const std::string& node, const std::string& parameter,
                    const std::string& part) {
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::bad_input);
    EXPECT_EQ(status.error().node, node);
    EXPECT_EQ(status.error().parameter, parameter);
    EXPECT_NE(status.error().text().find(part), std::string::npos) << status.error().text();
}

TEST(Graph, refuses_unknown_names_and_offers_the_nearest) {
    Graph graph = chain();
    expect_refused(graph.add_node("c", "nubmer"), "c", "type", "did you mean 'number'?");
    expect_refused(graph.add_node("a", "number"), "a", "", "already");
    expect_refused(graph.set("totl", "factor", 1), "totl", "", "did you mean 'total'?");
    expect_refused(graph.set("a", "vlaue", 1), "a", "vlaue", "did you mean 'value'?");
    expect_refused(graph.set("total", "terms", {"@a.forse"}), "total", "terms", "did you mean 'force'?");
    expect_refused(graph.set("total", "terms", {"@c.force"}), "total", "terms", "there is no node 'c'");
    expect_refused(graph.connect({"a", "force"}, {"total", "trems"}), "total", "trems", "did you mean 'terms'?");
    EXPECT_FALSE(graph.evaluate("total", "sum", 1));
    EXPECT_FALSE(graph.evaluate("nobody", "force", 1));
}

TEST(Graph, refuses_names_that_scripts_could_not_write) {
    Graph graph(number_nodes::kRegistry);
    for (const std::string name : {"", "a=b", "@a", "a/b", "a\nb", "\xff"})
        EXPECT_FALSE(graph.add_node(name, "number")) << name;
    EXPECT_FALSE(graph.add_node(std::string(201, 'x'), "number"));
    const auto refusal = [&](const std::string& name) { return graph.add_node(name, "number").error().what; };
    EXPECT_NE(refusal("M\xc3\xbcll/1").find("\"M\xc3\xbcll/1\" is"), std::string::npos);
    EXPECT_NE(refusal(std::string(39, 'x') + "\xc3\xb6=").find("xx\"... is"), std::string::npos);  // not cut within it
    EXPECT_TRUE(graph.add_node("Body.001 \xc3\xa9", "number"));
    EXPECT_TRUE(graph.add_node("sum", "sum"));
    EXPECT_TRUE(graph.set("sum", "terms", "@Body.001 \xc3\xa9.force"));  // split at the last dot
}

TEST(Graph, refuses_wires_that_do_not_fit_and_names_both_types) {
    Graph graph = chain();
    expect_refused(graph.set("out", "mesh", "@a.force"), "out", "mesh", "takes a mesh, but 'a.force' is a force");
    expect_refused(graph.set("out", "mesh", {"@a.force"}), "out", "mesh", "takes one wire");
    expect_refused(graph.set("out", "terms", 3), "out", "terms", "takes a list of wires");
    expect_refused(graph.set("out", "terms", {"a.force"}), "out", "terms", "takes a list of wires");
    expect_refused(graph.set("out", "terms", {"@a.force", "@a.force"}), "out", "terms", "twice");
    expect_refused(graph.connect({"a", "force"}, {"total", "terms"}), "total", "terms", "already");
}

TEST(Graph, refuses_cycles_and_names_the_way_round) {
    Graph graph = chain();
    expect_refused(graph.set("total", "terms", {"@out.force"}), "total", "terms", "total -> out -> total");
    expect_refused(graph.connect({"out", "force"}, {"total", "terms"}), "total", "terms", "total -> out -> total");
    expect_refused(graph.set("out", "terms", {"@out.force"}), "out", "terms", "out -> out");
}

TEST(Graph, stays_as_it_was_when_an_edit_is_refused) {
    Graph graph = chain();
    const Json before = graph.to_json();
    EXPECT_FALSE(graph.set("total", "terms", {"@b.force", "@out.force"}));
    EXPECT_FALSE(graph.set("a", "value", -3));
    EXPECT_FALSE(graph.set_frame_range(5, 4));
    EXPECT_FALSE(graph.set_frame_rate(0));
    EXPECT_FALSE(graph.set_frame_rate(std::nan("")));
    EXPECT_FALSE(graph.set_frame_range(-2000000, 4));
    EXPECT_FALSE(graph.set_threads(-1));
    EXPECT_EQ(graph.to_json(), before);
}

TEST(Graph, removing_a_node_removes_its_wires) {
    Graph graph = chain();
    ASSERT_TRUE(graph.remove_node("a"));
    EXPECT_EQ(*graph.wires({"total", "terms"}), (std::vector<SocketReference>{{"b", "force"}}));
    EXPECT_EQ(graph.node_names(), (std::vector<std::string>{"b", "total", "out"}));
    ASSERT_TRUE(graph.remove_node("b"));
    const Result<Value> value = graph.evaluate("out", "force", 1);  // total has nothing wired to it any more
    ASSERT_FALSE(value);
    expect_refused(value.error(), "total", "terms", "nothing is wired");
}

TEST(Graph, a_required_socket_is_missed_before_anything_is_cooked) {
    Graph graph = chain();
    ASSERT_TRUE(graph.add_node("late", "sum"));
    ASSERT_TRUE(graph.connect({"late", "force"}, {"out", "terms"}));
    ASSERT_FALSE(graph.check());
    EXPECT_FALSE(graph.evaluate("out", "force", 1));
    EXPECT_EQ(graph.cook_count("a"), 0u);
}

TEST(Graph, aliases_reach_the_renamed_parameter) {
    Graph graph = chain();
    ASSERT_TRUE(graph.set("a", "amount", 5));
    EXPECT_EQ(graph.parameter("a", "value")->get<double>(), 5);
    EXPECT_TRUE(graph.to_json()["nodes"]["a"].contains("value"));
    EXPECT_FALSE(graph.to_json()["nodes"]["a"].contains("amount"));
    ASSERT_TRUE(graph.reset("a", "amount"));
    EXPECT_EQ(graph.parameter("a", "amount")->get<double>(), 1);
}

TEST(Graph, former_values_of_a_choice_become_what_they_mean_today) {
    Graph graph = chain();
    ASSERT_TRUE(graph.set("a", "mode", true));
    EXPECT_EQ(graph.parameter("a", "mode")->get<std::string>(), "exact");
    ASSERT_TRUE(graph.set("a", "mode", false));
    EXPECT_EQ(graph.parameter("a", "mode")->get<std::string>(), "fast");
    EXPECT_FALSE(graph.set("a", "mode", 1));
}

TEST(Graph, wires_are_replaced_where_one_fits_and_added_where_many_do) {
    Graph graph = chain();
    ASSERT_TRUE(graph.add_node("c", "number"));
    ASSERT_TRUE(graph.connect({"c", "force"}, {"total", "terms"}));
    EXPECT_EQ(graph.wires({"total", "terms"})->size(), 3u);
    ASSERT_TRUE(graph.disconnect({"total", "terms"}));
    EXPECT_TRUE(graph.wires({"total", "terms"})->empty());
    ASSERT_TRUE(graph.set("total", "terms", nullptr));
    ASSERT_TRUE(graph.set("total", "terms", "@c.force"));
    EXPECT_EQ(graph.wires({"total", "terms"})->size(), 1u);
}

}  // namespace
}  // namespace sunder
