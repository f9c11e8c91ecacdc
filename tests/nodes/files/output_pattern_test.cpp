#include "nodes/files/output_pattern.h"

#include <gtest/gtest.h>

#include "nodes/files/frame_number.h"

namespace sunder {
namespace {

TEST(OutputPattern, fills_in_the_frame) {
    EXPECT_EQ(output_path("mesh/bunny.####.ply", 7), "mesh/bunny.0007.ply");
    EXPECT_EQ(output_path("a.##", 12345), "a.12345");
    EXPECT_EQ(output_path("a.####.obj", -12), "a.-012.obj");
    EXPECT_EQ(output_path("####", 0), "0000");
}

TEST(OutputPattern, what_lies_between_frames_stands_behind_the_earlier_one) {
    EXPECT_EQ(output_path("a.####.ply", 12.25), "a.0012_250.ply");
    EXPECT_EQ(output_path("a.####.ply", 1001 + 2.0 / 3), "a.1001_667.ply");
    EXPECT_EQ(output_path("a.####.ply", 63.0 / 64), "a.0000_984.ply");
    EXPECT_EQ(output_path("a.####.ply", -2.75), "a.-003_250.ply");
    EXPECT_EQ(output_path("a.####.ply", -0.25), "a.-001_750.ply");
    for (int n = 1; n <= 64; ++n) {
        std::string before;
        for (int step = 0; step <= n; ++step) {
            const std::string path = output_path("a.####.ply", sub_frame(1, step, n));
            EXPECT_LT(before, path) << n;
            before = path;
        }
        EXPECT_EQ(before, "a.0002.ply");
    }
    EXPECT_EQ(sub_frame(7, 1, 3), sub_frame(7, 2, 6));
    EXPECT_EQ(frame_text(-3), "-3");
    EXPECT_EQ(frame_text(100000), "100000");
    EXPECT_EQ(frame_text(12.25), "12.25");
    EXPECT_EQ(std::stod(frame_text(sub_frame(1001, 1, 3))), sub_frame(1001, 1, 3));
}

TEST(OutputPattern, a_whole_shot_has_the_name_without_the_frame) {
    EXPECT_EQ(shot_path("mesh/bunny.####.ply", ".usda"), "mesh/bunny.usda");
    EXPECT_EQ(shot_path("bunny_v2_####.ply", ".glb"), "bunny_v2.glb");
    EXPECT_EQ(shot_path("a/####.ply", ".pc2"), "a/shot.pc2");
    EXPECT_EQ(shot_path("##-old.ply", ".pc2"), "-old.pc2");
}

TEST(OutputPattern, refuses_what_leaves_the_output_folder) {
    for (const char* pattern : {"", "/tmp/a.####.ply", "../a.####.ply", "a/../../b.####.ply", "a//b.####.ply",
                                "./a.####.ply", "a/####.ply/", "C:\\a.####.ply", "..\\a.####.ply"})
        EXPECT_FALSE(check_output_pattern(pattern)) << pattern;
}

TEST(OutputPattern, refuses_frames_that_would_overwrite_one_another) {
    for (const char* pattern : {"a.ply", "##/a.##.ply", "####/a.ply"})
        EXPECT_FALSE(check_output_pattern(pattern)) << pattern;
    for (const char* pattern : {"a.#.ply", "deep/er/a.######.ply", "####"})
        EXPECT_TRUE(check_output_pattern(pattern)) << pattern;
}

}  // namespace
}  // namespace sunder
