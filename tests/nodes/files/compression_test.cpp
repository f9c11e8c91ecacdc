// Compressed files give back their bytes, and damaged ones an error that names them.
#include "nodes/files/compression.h"

#include <gtest/gtest.h>

#include <random>

namespace sunder {
namespace {

std::string some_frame(size_t n) {
    std::mt19937 random(3);
    std::string bytes = "ply\n";
    while (bytes.size() < n) bytes += std::string(random() % 9, static_cast<char>(random() % 4));
    return bytes;
}

TEST(Compression, gives_back_the_bytes) {
    for (const std::string& bytes :
         {std::string(), std::string(1, 'x'), some_frame(1 << 20), std::string(1 << 24, '\0')}) {
        const auto packed = compress(bytes);
        ASSERT_TRUE(packed);
        const auto whole = decompress(packed->view(), "f.ply.zst");
        ASSERT_TRUE(whole) << whole.error().text();
        EXPECT_TRUE(*whole == bytes) << bytes.size();
    }
    EXPECT_LT(compress(some_frame(1 << 20))->view().size(), 1u << 19);
}

TEST(Compression, a_file_cut_off_anywhere_is_refused_by_name) {
    const auto packed = compress(some_frame(5000));
    for (size_t n = 0; n < packed->view().size(); ++n) {
        const auto part = decompress(packed->view().substr(0, n), "f.ply.zst");
        ASSERT_FALSE(part) << n;
        EXPECT_EQ(part.error().code, ErrorCode::bad_input);
        EXPECT_EQ(part.error().where, "f.ply.zst");
    }
}

TEST(Compression, a_changed_byte_is_noticed_and_so_are_bytes_behind_the_end) {
    const std::string bytes = some_frame(5000), packed(compress(bytes)->view());
    for (size_t at = 0; at < packed.size(); ++at) {
        std::string changed = packed;
        changed[at] ^= 0x10;
        const auto whole = decompress(changed, "f.ply.zst");
        EXPECT_TRUE(!whole || *whole == bytes) << at;  // some bits of the header say nothing of the contents
    }
    const auto longer = decompress(packed + "more", "f.ply.zst");
    ASSERT_FALSE(longer);
    EXPECT_NE(longer.error().what.find("behind its end"), std::string::npos);
    EXPECT_FALSE(decompress("ply\nformat", "f.ply.zst"));
}

TEST(Compression, names_tell) {
    EXPECT_TRUE(is_compressed("mesh/a.0001.ply.zst"));
    EXPECT_FALSE(is_compressed("mesh/a.0001.ply"));
    EXPECT_EQ(uncompressed_path("mesh/a.0001.ply.zst"), "mesh/a.0001.ply");
    EXPECT_EQ(uncompressed_path("mesh/a.0001.ply"), "mesh/a.0001.ply");
}

}  // namespace
}  // namespace sunder
