#include "nodes/files/ply_file.h"

#include <gtest/gtest.h>

namespace sunder {
namespace {

std::string ply(const std::string& header, const std::string& rows = "") {
    return "ply\nformat binary_little_endian 1.0\n" + header + "end_header\n" + rows;
}

std::string fault_of(const std::string& bytes) {
    const auto file = PlyFile::parse(bytes, "a.ply");
    if (file) return "";
    EXPECT_EQ(file.error().code, ErrorCode::bad_input);
    EXPECT_EQ(file.error().where, "a.ply");
    return file.error().what;
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(PlyFile, reads_back_what_was_written) {
    ByteBuffer bytes;
    PlyElement face{"face", 2, {{"vertex_indices", PlyType::int32, PlyType::uint8}, {"material", PlyType::int16, {}}}};
    write_ply_header(bytes, {{"hello"}, {{"point", 2, ply_scalars("x y", PlyType::float64)}, face}});
    for (double v : {1.5, -0.0, 1e300, 4.9e-324}) bytes.number(v);
    for (int n : {0, 3}) {  // a list may be empty
        bytes.number(static_cast<uint8_t>(n));
        for (int i = 0; i < n; ++i) bytes.number(i);
        bytes.number(int16_t{-7});
    }
    const auto file = PlyFile::parse(std::string(bytes.view()), "a.ply");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_TRUE(file->has_comment("hello"));
    const PlyElement* point = file->find("point");
    ASSERT_TRUE(point && file->find("face") && !file->find("edge"));
    EXPECT_EQ(PlyFile::row_bytes(*point), 16u);
    EXPECT_EQ(read_number<double>(file->rows(*point) + 24), 4.9e-324);
}

TEST(PlyFile, every_truncation_is_noticed) {
    ByteBuffer bytes;
    PlyElement face{"face", 2, {{"vertex_indices", PlyType::int32, PlyType::uint8}}};
    write_ply_header(bytes, {{}, {{"point", 3, ply_scalars("x y", PlyType::float32)}, face}});
    for (int i = 0; i < 6; ++i) bytes.number(1.0f);
    for (int f = 0; f < 2; ++f) {
        bytes.number(uint8_t{3});
        for (int i = 0; i < 3; ++i) bytes.number(i);
    }
    const std::string whole(bytes.view());
    ASSERT_EQ(fault_of(whole), "");
    for (size_t n = 0; n < whole.size(); ++n) EXPECT_NE(fault_of(whole.substr(0, n)), "") << n << " bytes";
    EXPECT_TRUE(has(fault_of(whole.substr(0, whole.size() - 1)), "face 1 of 2"))
        << fault_of(whole.substr(0, whole.size() - 1));
    EXPECT_TRUE(has(fault_of(whole + "x"), "1 bytes more"));
}

TEST(PlyFile, counts_that_no_file_can_hold_are_refused_at_once) {
    EXPECT_TRUE(has(fault_of(ply("element p 18446744073709551615\nproperty double x\n", "12345678")), "p 1 of"));
    EXPECT_TRUE(has(fault_of(ply("element p 99999999999999999999\nproperty double x\n")), "not understood"));
    EXPECT_NE(fault_of(ply("element p 1000000000000\nproperty list uchar int i\n", "\x01")), "");
    EXPECT_TRUE(has(fault_of(ply("element p 4000000000\n")), "no properties"));
    EXPECT_TRUE(has(fault_of(ply("element p 1\nproperty list char int i\n", "\xff")), "negative"));
    EXPECT_NE(fault_of(ply("element p 1\nproperty list uint double i\n", "\xff\xff\xff\xff")), "");
}

TEST(PlyFile, foreign_files_are_refused_politely) {
    EXPECT_TRUE(has(fault_of(""), "not a PLY file"));
    EXPECT_TRUE(has(fault_of("solid cube\n"), "not a PLY file"));
    EXPECT_TRUE(has(fault_of("plywood\n"), "not a PLY file"));
    EXPECT_TRUE(has(fault_of(std::string(100'000, 'p')), "not a PLY file"));
    EXPECT_TRUE(has(fault_of("ply\nformat ascii 1.0\nend_header\n"), "another kind"));
    EXPECT_TRUE(has(fault_of("ply\nend_header\n"), "no format"));
    EXPECT_TRUE(has(fault_of("ply\n" + std::string(200'000, 'c')), "does not end"));
    EXPECT_TRUE(has(fault_of(ply("property double x\n")), "not understood"));
    EXPECT_TRUE(has(fault_of(ply("element p\n")), "not understood"));
    EXPECT_TRUE(has(fault_of(ply("element p 1\nproperty quad x\n")), "not understood"));
    EXPECT_TRUE(has(fault_of(ply("element p 1\nproperty list float int x\n")), "not understood"));
    EXPECT_TRUE(has(fault_of(ply("\n")), "empty line"));
}

}  // namespace
}  // namespace sunder
