// A number that is described once is found wherever numbers of its kind are: a field that one of these lists forgot
// would be accepted unchecked, kept out of keys, or shown to nobody.
#include "nodes/graph/field_parameters.h"

#include <gtest/gtest.h>

#include <array>

#include "nodes/graph/field_json.h"
#include "nodes/graph/graph.h"
#include "nodes/graph/registry.h"
#include "solver/data/frame_state.h"
#include "solver/scene/scene_fields.h"

namespace sunder {
namespace {

// Two fields as a material has them, and one more.
struct Dough {
    double stiffness = 3;
    double toughness = kNever;
    int rises = 2;

    Status check(const std::string& where) const;
};

std::span<const Field<Dough>> dough_fields() {
    static const std::array fields = {
        Field<Dough>{{.name = "stiffness", .label = "Stiffness", .unit = "Pa", .sentence = "Of dough", .max = 10},
                     &Dough::stiffness},
        Field<Dough>{{.name = "toughness", .label = "Toughness", .sentence = "Null: never", .min = 0},
                     &Dough::toughness},
        Field<Dough>{{.name = "rises", .label = "Rises", .sentence = "How often it does", .min = 0, .max = 4},
                     &Dough::rises}};
    static_assert(fields.size() == n_members<Dough>());
    return fields;
}

Status Dough::check(const std::string& where) const { return check_fields(dough_fields(), *this, where); }

// Gives how often it rises, as the drag of a force.
Result<Value> bake_dough(CookContext& context) {
    Dough dough;
    read_fields(context.parameters(), dough_fields(), dough);
    if (Status ok = dough.check("node '" + context.node() + "'"); !ok) return ok.error();
    Force force;
    force.drag = dough.rises + (dough.toughness == kNever ? 100 : 0);
    return make_value(force);
}

Registry bakery() {
    NodeType dough;
    dough.description = {.type = "dough", .label = "Dough", .category = "simulation", .sentence = "Dough."};
    dough.description.outputs = {{.name = "force", .label = "Force", .type = SocketType::force, .sentence = "It"}};
    dough.description.parameters = parameters_of(dough_fields());
    dough.cook = bake_dough;
    return Registry({dough});
}

double drag(Graph& graph) {
    const auto value = graph.evaluate("dough", "force", 1);
    EXPECT_TRUE(value) << value.error().text();
    return std::get<std::shared_ptr<const Force>>(*value)->drag;
}

TEST(FieldParameters, one_more_field_is_found_everywhere) {
    const Registry registry = bakery();
    Dough risen;
    risen.rises = 3;

    Dough wrong;
    wrong.rises = 5;
    ASSERT_FALSE(wrong.check("here"));
    EXPECT_EQ(wrong.check("here").error().text(), "here: rises is 5 (permitted: 0 to 4)");
    EXPECT_NE(hash_of(numbers_of(dough_fields(), Dough())), hash_of(numbers_of(dough_fields(), risen)));
    KeyHasher key, other_key;
    add_fields(key, dough_fields(), Dough()), add_fields(other_key, dough_fields(), risen);
    EXPECT_NE(key.key(), other_key.key());
    EXPECT_EQ(json_of_fields(dough_fields(), risen).dump(), R"({"stiffness":3.0,"toughness":null,"rises":3})");

    Graph graph(registry);
    ASSERT_TRUE(graph.add_node("dough", "dough"));
    EXPECT_EQ(drag(graph), 102);
    const auto before = graph.keys();
    ASSERT_TRUE(graph.set("dough", "rises", 4));
    EXPECT_NE(graph.keys(), before);
    EXPECT_EQ(drag(graph), 104);
    ASSERT_TRUE(graph.set("dough", "toughness", 0.5));
    EXPECT_EQ(drag(graph), 4);
    const Status refused = graph.set("dough", "rises", 5);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().parameter, "rises");

    EXPECT_NE(
        node_reference_markdown(registry).find("| `rises` | Rises | integer |  | `2` | 0 <= value <= 4 | How often"),
        std::string::npos);
    // What the C ABI gives hosts.
    const Json parameters = descriptions_to_json(registry)["nodes"][0]["parameters"];
    EXPECT_EQ(parameters[2]["name"], "rises");
    EXPECT_EQ(parameters[2]["max"], 4);
}

template <class T>
void expect_parameters(const char* type, std::span<const Field<T>> fields) {
    const NodeDescription& node = standard_registry().find(type)->description;
    for (const Field<T>& field : fields) {
        const ParameterDescription* const p = node.find_parameter(field.description.name);
        ASSERT_TRUE(p) << type << " has no " << field.description.name;
        if (p->type == ParameterType::choice) continue;  // of words, each of which is a number
        EXPECT_EQ(p->min_excluded, field.description.min_excluded) << p->name;
        EXPECT_EQ(p->min.value_or(-kNever), field.description.min) << p->name;
        EXPECT_EQ(p->max.value_or(kNever), field.description.max) << p->name;
    }
}

// A solver that refuses what its node permits, or the other way round, is found in the middle of a shot.
TEST(FieldParameters, nodes_permit_what_the_solver_does) {
    expect_parameters("body", material_fields());
    expect_parameters("solver", settings_fields());
}

}  // namespace
}  // namespace sunder
