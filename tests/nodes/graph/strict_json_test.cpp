#include "nodes/graph/strict_json.h"

#include <gtest/gtest.h>

namespace sunder {
namespace {

std::string fault(const std::string& text) {
    const Result<Json> json = parse_json(text, "shot.json");
    if (json) return "parsed";
    EXPECT_EQ(json.error().code, ErrorCode::bad_input);
    EXPECT_EQ(json.error().where, "shot.json");
    return json.error().what;
}

TEST(StrictJson, reads_what_the_library_reads) {
    const std::string text = R"({"z": [1, -2, 2.5, 1e3, "t\u00e9xt", true, null], "a": {"b": {}, "c": []}})";
    const Result<Json> json = parse_json(text, "");
    ASSERT_TRUE(json);
    EXPECT_EQ(*json, Json::parse(text));
    EXPECT_EQ(json->begin().key(), "z");  // order kept
}

TEST(StrictJson, tells_line_and_column_of_a_fault) {
    EXPECT_NE(fault("{\n  \"a\": 1,\n  \"b\": ?\n}").find("line 3, column 8"), std::string::npos);
}

TEST(StrictJson, tells_where_a_file_was_cut_off) {
    const std::string whole = "{\"sunder\": 1,\n \"nodes\": {\"a\": {\"type\": \"lattice\"}}}";
    for (size_t n = 0; n < whole.size(); ++n) {
        const std::string text = fault(whole.substr(0, n));
        EXPECT_NE(text, "parsed") << n;
        EXPECT_NE(text.find("line "), std::string::npos) << n << ": " << text;
    }
    EXPECT_NE(fault("{\"sunder\": 1,\n \"nodes\": {").find("ends too early, at line 2"), std::string::npos);
}

TEST(StrictJson, refuses_a_key_that_appears_twice) {
    EXPECT_EQ(fault(R"({"nodes": {"a": {"mass": 1, "mass": 2}}})"), "the key 'nodes.a.mass' appears twice");
    EXPECT_EQ(fault(R"({"a": {"x": 1}, "b": {"x": 1}})"), "parsed");
}

TEST(StrictJson, refuses_numbers_that_are_not_finite) {
    EXPECT_NE(fault("{\"a\": 1e999}").find("too large"), std::string::npos);
    EXPECT_NE(fault("{\"a\": NaN}"), "parsed");
}

TEST(StrictJson, refuses_bottomless_nesting) {
    EXPECT_NE(fault(std::string(100000, '[')).find("nested deeper"), std::string::npos);
    EXPECT_NE(fault("[1] [2]"), "parsed");
    EXPECT_NE(fault("{\"a\": \"\xff\xfe\"}"), "parsed");
}

}  // namespace
}  // namespace sunder
