#include "nodes/graph/parameter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/nodes/number_nodes.h"

namespace sunder {
namespace {

const ParameterDescription& described(const std::string& name) {
    return *number_nodes::kRegistry.find("number")->description.find_parameter(name);
}

ParameterValue value(const std::string& name, const Json& json) {
    Result<ParameterValue> checked = ParameterValue::check(described(name), json, "n");
    EXPECT_TRUE(checked) << (checked ? "" : checked.error().text());
    return checked.take();
}

std::string fault(const std::string& name, const Json& json) {
    const Result<ParameterValue> checked = ParameterValue::check(described(name), json, "n");
    if (checked) return "accepted";
    EXPECT_EQ(checked.error().code, ErrorCode::bad_input);
    EXPECT_EQ(checked.error().node, "n");
    EXPECT_EQ(checked.error().parameter, name);
    EXPECT_EQ(checked.error().where, "node 'n', parameter '" + name + "'");
    return checked.error().what + " (" + checked.error().mend + ")";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(Parameter, refuses_wrong_types) {
    EXPECT_TRUE(contains(fault("value", "2"), "takes a number, not \"2\""));
    EXPECT_TRUE(contains(fault("value", true), "takes a number"));
    EXPECT_TRUE(contains(fault("value", Json::array({1})), "takes a number"));
    EXPECT_TRUE(contains(fault("value", "@a.force"), "wires go to sockets"));
    EXPECT_TRUE(contains(fault("value", nullptr), "takes a number, not null"));
    EXPECT_TRUE(contains(fault("count", 2.5), "whole number"));
    EXPECT_TRUE(contains(fault("on", 1), "true or false"));
    EXPECT_TRUE(contains(fault("axis", {1, 2}), "three numbers"));
    EXPECT_TRUE(contains(fault("axis", {1, 2, "x"}), "three numbers"));
    EXPECT_TRUE(contains(fault("mode", 1), "text"));
}

TEST(Parameter, refuses_values_out_of_range_and_names_the_range) {
    EXPECT_TRUE(contains(fault("value", -1), "-1.0 m is out of range (permitted: 0 <= value <= 1000)"))
        << fault("value", -1);
    EXPECT_TRUE(contains(fault("limit", 0), "permitted: value > 0"));
    EXPECT_TRUE(contains(fault("count", 0), "out of range"));
    EXPECT_TRUE(contains(fault("count", 1e18), "out of range"));
    EXPECT_TRUE(contains(fault("count", 5), "permitted: 1, 4, 9"));
    EXPECT_TRUE(contains(fault("mode", "fats"), "did you mean 'fast'?"));
}

TEST(Parameter, refuses_numbers_that_are_not_finite) {
    EXPECT_TRUE(contains(fault("value", std::nan("")), "not finite"));
    EXPECT_TRUE(contains(fault("axis", {0, INFINITY, 0}), "not finite"));
    EXPECT_TRUE(contains(fault("value", {{"keys", {{1, INFINITY}}}}), "not finite"));
    EXPECT_TRUE(contains(fault("count", std::nan("")), "whole number"));
}

TEST(Parameter, points_are_lists_of_three_numbers_in_range) {
    const ParameterDescription& points = *standard_registry().find("prefracture")->description.find_parameter("points");
    const Result<ParameterValue> two = ParameterValue::check(points, {{1, 2, 3}, {0.5, 0, -1}}, "n");
    ASSERT_TRUE(two);
    EXPECT_EQ(two->to_json().dump(), "[[1.0,2.0,3.0],[0.5,0.0,-1.0]]");
    EXPECT_TRUE(ParameterValue::check(points, Json::array(), "n"));
    for (const Json& bad : {Json(1), Json("[[1,2,3]]"), Json::array({1, 2, 3}), Json::array({Json::array({1, 2})}),
                            Json::array({Json::array({1, 2, "x"})}), Json::array({Json::array({1, 2, NAN})}),
                            Json::array({Json::array({1, 2, 1e7})}), Json(nullptr)}) {
        const Result<ParameterValue> value = ParameterValue::check(points, bad, "n");
        ASSERT_FALSE(value) << bad;
        EXPECT_EQ(value.error().parameter, "points");
    }
}

TEST(Parameter, takes_one_and_one_point_zero_as_the_same) {
    EXPECT_EQ(value("value", 1).to_json().dump(), value("value", 1.0).to_json().dump());
    EXPECT_EQ(value("count", 4.0).to_json().dump(), "4");
}

TEST(Parameter, blends_between_keys_and_holds_outside) {
    const ParameterValue v = value("value", {{"keys", {{10, 1}, {20, 3}, {30, 3}}}});
    EXPECT_EQ(v.at(-5).get<double>(), 1);
    EXPECT_EQ(v.at(10).get<double>(), 1);
    EXPECT_EQ(v.at(15).get<double>(), 2);
    EXPECT_EQ(v.at(20).get<double>(), 3);
    EXPECT_EQ(v.at(25).get<double>(), 3);
    EXPECT_EQ(v.at(99).get<double>(), 3);
    const ParameterValue axis = value("axis", {{"keys", {{0, {0, 0, 0}}, {4, {4, 8, -4}}}}});
    EXPECT_EQ(axis.at(1), Json({1.0, 2.0, -1.0}));
}

TEST(Parameter, steps_hold_the_earlier_key) {
    const ParameterValue v = value("value", {{"keys", {{10, 1}, {20, 3}}}, {"interpolation", "step"}});
    EXPECT_EQ(v.at(19.99).get<double>(), 1);
    EXPECT_EQ(v.at(20).get<double>(), 3);
    EXPECT_EQ(value("mode", {{"keys", {{1, "fast"}, {5, "exact"}}}}).at(4), "fast");
    EXPECT_TRUE(contains(fault("mode", {{"keys", {{1, "fast"}}}, {"interpolation", "linear"}}), "steps"));
}

TEST(Parameter, null_is_never_blended) {
    EXPECT_TRUE(contains(fault("limit", {{"keys", {{1, nullptr}, {5, 2}}}}), "use interpolation step"));
    const ParameterValue v = value("limit", {{"keys", {{1, nullptr}, {5, 2}}}, {"interpolation", "step"}});
    EXPECT_TRUE(v.at(4).is_null());
    EXPECT_EQ(v.at(5).get<double>(), 2);
}

TEST(Parameter, refuses_malformed_animations) {
    EXPECT_TRUE(contains(fault("value", Json::object()), "at least one key"));
    EXPECT_TRUE(contains(fault("value", {{"keys", Json::array()}}), "at least one key"));
    EXPECT_TRUE(contains(fault("value", {{"keys", {{1, 1}, {1, 2}}}}), "ascending"));
    EXPECT_TRUE(contains(fault("value", {{"keys", {{2, 1}, {1, 2}}}}), "ascending"));
    EXPECT_TRUE(contains(fault("value", {{"keys", {{1, 2, 3}}}}), "no key"));
    EXPECT_TRUE(contains(fault("value", {{"keys", Json::array({Json::array({"1", 2})})}}), "no key"));
    EXPECT_TRUE(contains(fault("value", {{"keys", {{1, -2}}}}), "out of range"));
    EXPECT_TRUE(contains(fault("value", {{"keys", {{1, 2}}}, {"interpolation", "cubic"}}), "permitted: linear, step"));
    EXPECT_TRUE(contains(fault("value", {{"keys", {{1, 2}}}, {"easing", 1}}), "unknown name 'easing'"));
    EXPECT_TRUE(contains(fault("count", {{"keys", {{1, 4}}}}), "cannot be animated"));
}

TEST(Parameter, is_written_as_it_was_read) {
    for (const Json& json : {Json(2.5), Json{{"keys", {{1, 2.0}, {2.5, 3.0}}}, {"interpolation", "linear"}}}) {
        EXPECT_EQ(value("value", json).to_json(), json);
    }
    EXPECT_TRUE(value("limit", nullptr).to_json().is_null());
}

TEST(Parameter, integrals_of_keys_are_exact) {
    EXPECT_EQ(value("value", 0.25).integral(-3, 9), 3);
    const Json ramp = {{"keys", {{2, 4}, {4, 0}, {8, 1}}}};  // linear: 4 before, a triangle, a slope of 1/4, 1 after
    const ParameterValue linear = value("value", ramp);
    EXPECT_EQ(linear.integral(0, 2), 8);
    EXPECT_EQ(linear.integral(0, 4), 12);
    EXPECT_EQ(linear.integral(3, 6), 1 + 0.5);
    EXPECT_EQ(linear.integral(0, 10), 8 + 4 + 2 + 2);
    EXPECT_EQ(linear.integral(5, 5), 0);
    Json steps = ramp;
    steps["interpolation"] = "step";
    EXPECT_EQ(value("value", steps).integral(0, 10), 4 * 2 + 4 * 2 + 0 * 4 + 1 * 2);
    EXPECT_EQ(value("value", steps).integral(2.5, 3), 2);
}

TEST(Parameter, slopes_of_keys_are_those_from_there_on) {
    const Json ramp = {{"keys", {{2, 4}, {4, 0}, {8, 1}}}};
    const ParameterValue linear = value("value", ramp);
    for (const auto& [frame, slope] :
         {std::pair(0.0, 0.0), {2, -2}, {3.5, -2}, {4, 0.25}, {7.9, 0.25}, {8, 0}, {99, 0}})
        EXPECT_EQ(linear.slope(frame), slope) << frame;
    Json steps = ramp;
    steps["interpolation"] = "step";
    EXPECT_EQ(value("value", steps).slope(3), 0);
    EXPECT_EQ(value("value", 0.25).slope(3), 0);
}

}  // namespace
}  // namespace sunder
