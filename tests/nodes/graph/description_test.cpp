#include "nodes/graph/description.h"

#include <gtest/gtest.h>

#include <set>

#include "nodes/graph/json.h"
#include "nodes/graph/parameter.h"
#include "nodes/graph/registry.h"

namespace sunder {
namespace {

TEST(Description, all_node_types_are_there) {
    std::vector<std::string> types;
    for (const NodeType& type : standard_registry().types()) types.push_back(type.description.type);
    EXPECT_EQ(types, (std::vector<std::string>{
                         "mesh_file",  "lattice",  "prefracture", "fragment_region", "body",       "body_region",
                         "follow",     "activate", "seam",        "rigid_body",      "collider",   "pin",
                         "force",      "blast",    "point_force", "vortex",          "turbulence", "guide",
                         "grid_force", "pressure", "solver",      "deformer",        "bake_mesh",  "bake_state"}));
}

TEST(Description, every_default_fits_its_own_description) {
    for (const NodeType& type : standard_registry().types())
        for (const ParameterDescription& p : type.description.parameters) {
            const Result<ParameterValue> value = ParameterValue::check(p, p.default_value, type.description.type);
            EXPECT_TRUE(value) << value.error().text();
            if (!value) continue;
            EXPECT_EQ(value->to_json().dump(), p.default_value.get().dump()) << p.name << ": written as its type";
        }
}

TEST(Description, names_are_unique_and_nothing_is_left_unsaid) {
    for (const NodeType& type : standard_registry().types()) {
        const NodeDescription& d = type.description;
        std::set<std::string> names = {"type"};
        for (const SocketDescription& s : d.inputs) EXPECT_TRUE(names.insert(s.name).second) << d.type << "." << s.name;
        for (const ParameterDescription& p : d.parameters) {
            EXPECT_TRUE(names.insert(p.name).second) << d.type << "." << p.name;
            for (const std::string& alias : p.aliases)
                EXPECT_TRUE(names.insert(alias).second) << d.type << "." << alias;
            for (const auto& [former, choice] : p.former_values) {
                EXPECT_EQ(std::ranges::count(p.choices, choice.get(), &JsonValue::get), 1) << d.type << "." << p.name;
                EXPECT_EQ(std::ranges::count(p.choices, former.get(), &JsonValue::get), 0) << d.type << "." << p.name;
            }
            EXPECT_FALSE(p.label.empty() || p.sentence.empty()) << d.type << "." << p.name;
            EXPECT_FALSE(p.sentence.ends_with(".")) << d.type << "." << p.name;
            EXPECT_EQ(p.type == ParameterType::choice, !p.choices.empty() && p.choices[0].get().is_string())
                << d.type << "." << p.name;
        }
        for (const SocketDescription& s : d.outputs)
            EXPECT_FALSE(s.sentence.empty() || s.label.empty()) << d.type << "." << s.name;
        EXPECT_FALSE(d.label.empty() || d.sentence.empty() || d.outputs.empty()) << d.type;
        EXPECT_TRUE((std::set<std::string>{"input", "fracture", "simulation", "output"}.contains(d.category)))
            << d.type;
        EXPECT_TRUE(type.cook) << d.type;
    }
}

TEST(Description, the_reference_tells_of_every_node_socket_and_parameter) {
    const std::string text = node_reference_markdown();
    for (const NodeType& type : standard_registry().types()) {
        const size_t begin = text.find("`" + type.description.type + "`\n");
        ASSERT_NE(begin, std::string::npos) << type.description.type;
        const std::string section = text.substr(begin, text.find("\n##", begin) - begin);
        for (const SocketDescription& s : type.description.inputs)
            EXPECT_NE(section.find("| `" + s.name + "` |"), std::string::npos) << s.name;
        for (const SocketDescription& s : type.description.outputs)
            EXPECT_NE(section.find("| `" + s.name + "` |"), std::string::npos) << s.name;
        for (const ParameterDescription& p : type.description.parameters)
            EXPECT_NE(section.find("| `" + p.name + "` | " + p.label + " |"), std::string::npos) << p.name;
    }
}

TEST(Description, json_tells_ranges_units_and_choices) {
    const Json json = descriptions_to_json();
    EXPECT_EQ(json["nodes"].size(), standard_registry().types().size());
    const Json& body = json["nodes"][4];
    EXPECT_EQ(body["type"], "body");
    for (const Json& p : body["parameters"]) {
        const std::string name = p["name"];
        EXPECT_TRUE(name != "poisson_ratio" || p["max"] == 0.45);
        EXPECT_TRUE(name != "density" || (p["above"] == 0 && p["unit"] == "kg/m3" && !p.contains("min")));
        EXPECT_TRUE(name != "yield" || (p["nullable"] == true && p["default"].is_null() && p["animatable"] == false));
        EXPECT_TRUE(name != "toughness" || p["animatable"] == true);
        EXPECT_TRUE(name != "hardening" || p["needs_text"] == "yield is not null");
        EXPECT_EQ(p.contains("needs"), p.contains("needs_text")) << name;
        EXPECT_TRUE(p["group"].is_string()) << name;
    }
    EXPECT_EQ(body["inputs"][0]["type"], "fragments");
}

TEST(Description, needs_name_parameters_of_the_node_and_values_that_these_take) {
    for (const NodeType& type : standard_registry().types())
        for (const ParameterDescription& p : type.description.parameters)
            for (const std::vector<Condition>& alternative : p.needs) {
                EXPECT_FALSE(alternative.empty()) << p.name;
                for (const Condition& c : alternative) {
                    const ParameterDescription* const other = type.description.find_parameter(c.parameter);
                    ASSERT_TRUE(other && other->name == c.parameter && other != &p) << type.description.type << p.name;
                    EXPECT_EQ((c.values.empty() ? 0 : 1) + (c.above ? 1 : 0) + (c.not_null ? 1 : 0), 1) << p.name;
                    EXPECT_TRUE(!c.not_null || other->nullable) << p.name;
                    for (const JsonValue& value : c.values) {
                        const Result<ParameterValue> checked = ParameterValue::check(*other, value, "node");
                        EXPECT_TRUE(checked) << p.name << ": " << checked.error().text();
                    }
                }
            }
}

TEST(Description, needs_read_as_a_person_writes_them) {
    EXPECT_EQ(needs_text({.name = "p"}), "");
    EXPECT_EQ(needs_text({.name = "p", .needs = {{is("method", {"kmeans"}), is("source", {"tets", "voronoi"})}}}),
              "method = kmeans and source = tets or voronoi");
    EXPECT_EQ(needs_text({.name = "p", .needs = {{is_above("noise", 0)}, {is_not_null("yield")}}}, "`"),
              "`noise` > `0.0`, or `yield` is not null");
    EXPECT_EQ(needs_text({.name = "p", .needs = {{is("substeps", {nullptr})}}}), "substeps = null");
}

TEST(Description, groups_follow_what_is_seen_at_once_in_the_order_of_their_first_parameters) {
    NodeDescription d;
    d.parameters = {
        in_group("B", {.name = "b"}), {.name = "main"}, in_group("A", {.name = "a"}), in_group("B", {.name = "b_2"})};
    std::string told;
    for (const ParameterGroup& group : d.groups()) {
        told += group.label + ":";
        for (const ParameterDescription* p : group.parameters) told += " " + p->name;
        told += "; ";
    }
    EXPECT_EQ(told, ": main; B: b b_2; A: a; ");
    d.parameters = {in_group("B", {.name = "b"})};
    EXPECT_EQ(d.groups().size(), 1u);
    for (const NodeType& type : standard_registry().types()) {
        size_t n = 0;
        for (const ParameterGroup& group : type.description.groups()) n += group.parameters.size();
        EXPECT_EQ(n, type.description.parameters.size()) << type.description.type;
    }
}

TEST(Description, ranges_read_as_a_person_writes_them) {
    EXPECT_EQ(range_text({.name = "p", .min = 0, .max = 0.45, .min_excluded = true}), "0 < value <= 0.45");
    EXPECT_EQ(range_text({.name = "p", .min = 1}), "value >= 1");
    EXPECT_EQ(range_text({.name = "p", .max = 1e5, .max_excluded = true}), "value < 100000");
    EXPECT_EQ(range_text({.name = "p"}), "");
}

}  // namespace
}  // namespace sunder
