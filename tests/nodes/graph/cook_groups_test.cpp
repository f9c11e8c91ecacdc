// Several values of a frame asked for at once: what is cooked together, in which order, and whose errors are whose.
#include "nodes/graph/cook_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "nodes/graph/json.h"
#include "tests/nodes/number_nodes.h"

namespace sunder {
namespace {

using number_nodes::drag;

std::vector<std::vector<std::string>> calls;  // of cook_sums: the nodes of each

/// As cook_sum; tells of itself, and throws where it is told to.
std::vector<Result<Value>> cook_sums(std::span<CookContext* const> contexts) {
    calls.emplace_back();
    std::vector<Result<Value>> sums;
    for (CookContext* context : contexts) {
        calls.back().push_back(context->node());
        sums.push_back(number_nodes::cook_sum(*context));
        if (context->parameters().number("factor") == -1) throw std::runtime_error("odd");
    }
    for (CookContext* context : contexts)
        if (!context->progress().report(0.5, context->node()))
            return std::vector<Result<Value>>(contexts.size(), cancelled());
    return sums;
}

Result<Value> cook_one_sum(CookContext& context) {
    CookContext* const alone = &context;
    return std::move(cook_sums({&alone, 1}).front());
}

Registry registry() {
    std::vector<NodeType> types(number_nodes::kRegistry.types().begin(), number_nodes::kRegistry.types().end());
    types.push_back(*number_nodes::kRegistry.find("sum"));
    types.back().description.type = "joint";
    types.back().cook = cook_one_sum, types.back().cook_together = cook_sums;
    return Registry(types);
}
const Registry kRegistry = registry();

/// Numbers one, two, three; a joint sum of each, x1, x2, x3; "y" that joins x1 and x2; plain sums that read them.
class CookGroups : public testing::Test {
protected:
    CookGroups() : graph(kRegistry) {
        int value = 0;
        for (const char* number : {"one", "two", "three"}) {
            add(number, "number"), set(number, "value", ++value);
            add("x" + std::to_string(value), "joint");
            set("x" + std::to_string(value), "terms", "@" + std::string(number) + ".force");
        }
        add("y", "joint"), set("y", "terms", {"@x1.force", "@x2.force"});
        for (const char* plain : {"x1", "x3", "y"}) {
            add(std::string("of_") + plain, "sum");
            set(std::string("of_") + plain, "terms", "@" + std::string(plain) + ".force");
        }
        calls.clear();
    }

    void add(const std::string& name, const std::string& type) { ASSERT_TRUE(graph.add_node(name, type)) << name; }
    void set(const std::string& node, const std::string& name, const Json& value) {
        ASSERT_TRUE(graph.set(node, name, value)) << node;
    }
    std::vector<Result<Value>> all(const std::vector<std::string>& nodes, const Progress& progress = {}) {
        std::vector<SocketReference> outputs;
        for (const std::string& node : nodes) outputs.push_back({node, "force"});
        return graph.evaluate_all(outputs, 1, progress);
    }
    std::vector<double> drags(const std::vector<std::string>& nodes) {
        std::vector<double> found;
        for (const Result<Value>& value : all(nodes)) found.push_back(value ? drag(value) : -1);
        return found;
    }
    size_t n_cooked(const std::string& node) const { return graph.cook_count(node); }

    Graph graph;
};

using Calls = std::vector<std::vector<std::string>>;
using Numbers = std::vector<double>;

TEST_F(CookGroups, what_feeds_others_is_cooked_before_them_and_all_of_a_kind_at_once) {
    EXPECT_EQ(drags({"of_y", "of_x3", "of_x1"}), (Numbers{3, 3, 1}));
    EXPECT_EQ(calls, (Calls{{"x1", "x2", "x3"}, {"y"}})) << "y alone is cooked as ever";
    for (const char* node : {"one", "x1", "x2", "x3", "y", "of_y", "of_x1"}) EXPECT_EQ(n_cooked(node), 1u) << node;
}

TEST_F(CookGroups, what_is_there_is_not_cooked_again) {
    drags({"x2"});
    EXPECT_EQ(drags({"x1", "x2", "x3", "x3"}), (Numbers{1, 2, 3, 3}));
    EXPECT_EQ(drags({"of_x1", "of_x3"}), (Numbers{1, 3}));
    EXPECT_EQ(calls, (Calls{{"x2"}, {"x1", "x3"}}));
    set("two", "value", 5);
    EXPECT_EQ(drags({"x1", "y", "x2"}), (Numbers{1, 6, 5}));
    EXPECT_EQ(calls.size(), 4u);
    EXPECT_EQ(n_cooked("x1"), 1u);
    EXPECT_EQ(n_cooked("x2"), 2u);
    EXPECT_EQ(drags({}), Numbers{});
}

TEST_F(CookGroups, the_order_of_what_is_asked_for_changes_nothing) {
    EXPECT_EQ(drags({"x3", "of_y", "x1"}), (Numbers{3, 3, 1}));
    Numbers backwards = drags({"x1", "of_y", "x3"});
    EXPECT_EQ(backwards, (Numbers{1, 3, 3}));
    EXPECT_EQ(calls, (Calls{{"x3", "x1", "x2"}, {"y"}}));
}

TEST_F(CookGroups, values_that_differ_by_frame_are_made_for_the_frame_that_is_asked_for) {
    set("one", "value", {{"keys", {{1, 0}, {11, 10}}}});
    const std::vector<SocketReference> outputs = {{"x1", "force"}, {"x2", "force"}, {"y", "force"}};
    for (const int frame : {3, 1, 3}) {
        const auto values = graph.evaluate_all(outputs, frame);
        EXPECT_EQ(drag(values[0]), frame - 1);
        EXPECT_EQ(drag(values[2]), frame + 1);
    }
    EXPECT_EQ(n_cooked("x1"), 2u);
    EXPECT_EQ(n_cooked("x2"), 1u);
}

TEST_F(CookGroups, a_node_that_fails_fails_alone_and_is_named) {
    set("x2", "factor", 1e7);
    const auto values = all({"x1", "of_y", "x2", "of_x3", "nobody"});
    EXPECT_EQ(drag(values[0]), 1);
    EXPECT_EQ(drag(values[3]), 3);
    for (const size_t failed : {1, 2}) {
        ASSERT_FALSE(values[failed]);
        EXPECT_EQ(values[failed].error().where, "node 'x2'");
        EXPECT_EQ(values[failed].error().node, "x2");
    }
    ASSERT_FALSE(values[4]);
    EXPECT_EQ(values[4].error().node, "nobody");
    EXPECT_EQ(n_cooked("x2"), 1u) << "though two want it";
    EXPECT_EQ(graph.evaluate("x2", "force", 1).error().text(), values[2].error().text());
    set("x2", "factor", 1);
    EXPECT_EQ(drags({"of_y"}), Numbers{3}) << "a failure is not kept";
}

TEST_F(CookGroups, whatever_needs_a_node_that_is_not_wired_is_refused) {
    ASSERT_TRUE(graph.disconnect({"x2", "terms"}));
    const auto values = all({"y", "of_y", "x2", "x1"});
    for (const size_t refused : {0, 1, 2}) {
        ASSERT_FALSE(values[refused]) << refused;
        EXPECT_EQ(values[refused].error().parameter, "terms") << refused;
    }
    EXPECT_EQ(drag(values[3]), 1);
}

TEST_F(CookGroups, what_one_throws_is_no_other_s_error) {
    set("x2", "factor", -1);
    const auto values = all({"x1", "x2", "x3"});
    EXPECT_EQ(drag(values[0]), 1);
    EXPECT_EQ(drag(values[2]), 3);
    ASSERT_FALSE(values[1]);
    EXPECT_EQ(values[1].error().where, "node 'x2'");
    EXPECT_NE(values[1].error().what.find("odd"), std::string::npos);
}

TEST_F(CookGroups, once_cancelled_nothing_is_cooked_any_more) {
    int n_calls = 0;
    const Progress::Callback stop_once = [&](double, std::string_view) { return ++n_calls != 2; };
    for (const Result<Value>& value : all({"of_x1", "x2", "x3", "of_y"}, Progress(stop_once))) {
        ASSERT_FALSE(value);
        EXPECT_EQ(value.error().code, ErrorCode::cancelled);
        EXPECT_EQ(value.error().node, "");
    }
    EXPECT_EQ(n_calls, 2);
    EXPECT_EQ(calls, (Calls{{"x1", "x2", "x3"}}));
    EXPECT_EQ(n_cooked("of_x1") + n_cooked("y"), 0u);
    EXPECT_EQ(drags({"of_x1", "x2"}), (Numbers{1, 2})) << "and it works on";
}

TEST_F(CookGroups, progress_never_runs_backwards) {
    std::vector<double> told;
    const Progress::Callback note = [&](double fraction, std::string_view) {
        told.push_back(fraction);
        return true;
    };
    all({"of_x1", "of_y", "x2", "of_x3"}, Progress(note));
    EXPECT_EQ(told.size(), 4u);
    EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
    EXPECT_GT(told.front(), 0);
    EXPECT_LT(told.back(), 1);
}

}  // namespace
}  // namespace sunder
