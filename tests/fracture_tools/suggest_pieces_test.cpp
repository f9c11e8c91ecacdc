#include "fracture_tools/suggest_pieces.h"

#include <gtest/gtest.h>

#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using sunder::testing::make_box;

TEST(thinnest_extent, is_the_side_of_a_rod_and_the_thickness_of_a_plate) {
    EXPECT_NEAR(thinnest_extent(make_box(Vec3(0.2, 0.2, 20))), 0.2, 2e-3);
    EXPECT_NEAR(thinnest_extent(make_box(Vec3(3, 2, 0.1))), 0.1, 1e-12);
    TriMesh turned = make_box(Vec3(3, 2, 0.1));
    const Quat turn(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
    for (Vec3& x : turned.positions) x = turn * x + Vec3(10, 20, 30);
    EXPECT_NEAR(thinnest_extent(turned), 0.1, 1e-12);
}

TEST(suggest_pieces, does_not_depend_on_size_and_grows_as_the_error_falls) {
    const TriMesh small = make_box(Vec3(1, 1, 3)), large = make_box(Vec3(10, 10, 30));
    EXPECT_NEAR(suggest_pieces(small, 0.05), suggest_pieces(large, 0.05), 1);
    int last = 0;
    for (const double error : {1.0, 0.1, 0.05, 0.02, 1e-9}) {
        const int pieces = suggest_pieces(small, error);
        EXPECT_GT(pieces, last);
        last = pieces;
    }
    EXPECT_EQ(last, 100000);
}

}  // namespace
}  // namespace sunder
