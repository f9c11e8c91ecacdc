#include "nodes/files/output_pattern.h"

#include <gtest/gtest.h>

namespace sunder {
namespace {

TEST(OutputPattern, fills_in_the_frame) {
    EXPECT_EQ(output_path("mesh/bunny.####.ply", 7), "mesh/bunny.0007.ply");
    EXPECT_EQ(output_path("a.##", 12345), "a.12345");
    EXPECT_EQ(output_path("a.####.obj", -12), "a.-012.obj");
    EXPECT_EQ(output_path("####", 0), "0000");
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
