// Meshes of several parts, hollow ones and thin ones: each part is filled, or its fault is told.
#include <gtest/gtest.h>

#include <algorithm>

#include "fracture_tools/mesh/mesh_checks.h"
#include "tests/fracture_tools/fragments/cuts.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using testing::cut;
using testing::flipped;
using testing::joined;
using testing::kMethods;
using testing::make_box;
using testing::make_torus;
using testing::refused;
using testing::volume_sum;

TEST(Prefracture, separate_parts_never_share_a_piece) {
    const TriMesh mesh = joined(make_box(), make_box(Vec3(1, 1, 0.5)), Vec3(3, 0, 0));
    for (CutMethod method : kMethods) {
        const FragmentSet set = cut(mesh, 15, 0, method);
        EXPECT_EQ(set.fragments.size(), 15u);
        for (const Fragment& f : set.fragments) EXPECT_LT(f.radii.maxCoeff(), 1);
        EXPECT_EQ(cut(mesh, 1, 0, method).fragments.size(), 2u);
    }
    const FragmentSet fewer = cut(mesh, 1);  // less than there are parts
    EXPECT_EQ(fewer.fragments.size(), 2u);
    ASSERT_FALSE(fewer.warnings.empty());
    EXPECT_NE(fewer.warnings.back().find("2 pieces were made instead of 1"), std::string::npos);
}

TEST(Prefracture, tetrahedra_fill_every_part_or_the_part_is_named) {
    const TriMesh small = make_torus(0.04, 0.016, 32, 16);
    const TriMesh mesh = joined(joined(make_torus(), make_torus(), Vec3(3, 0, 0)), small, Vec3(1.3, 0.4, 0.2));
    const FragmentSet set = cut(mesh, 20);
    EXPECT_NEAR(volume_sum(set), mesh_volume(mesh), 0.02 * mesh_volume(mesh));
    size_t n_small = 0, n_far = 0;
    for (const Fragment& f : set.fragments) {
        const double x = f.centroid.x();
        n_small += x > 1 && x<2, n_far += x> 2;
    }
    EXPECT_EQ(n_small, 1u);
    EXPECT_GE(n_far, 5u);
    // Too small for a piece of this cut: left out, and told where.
    const FragmentSet two = cut(mesh, 2);
    EXPECT_EQ(two.fragments.size(), 2u);
    const bool is_told = std::ranges::any_of(two.warnings, [](const std::string& text) {
        return text.find("1 separate parts much smaller than a piece were left out, first near (1.") != text.npos;
    });
    EXPECT_TRUE(is_told);
}

TEST(Prefracture, a_cavity_stays_empty) {
    const TriMesh mesh = joined(make_box(), flipped(make_box(Vec3::Constant(0.5))), Vec3::Constant(0.25));
    for (CutMethod method : kMethods)
        for (int pieces : {1, 40}) EXPECT_NEAR(volume_sum(cut(mesh, pieces, 0, method)), 0.875, 1e-9);
}

TEST(Prefracture, a_plate_too_thin_for_tetrahedra_is_refused_at_once_and_told_so) {
    const Error e = refused(make_box(Vec3(1, 1, 1e-3)));
    EXPECT_NE(e.what.find("too thin (about 0.000998 m)"), std::string::npos) << e.text();
    EXPECT_EQ(e.mend, "set source to voronoi");
}

}  // namespace
}  // namespace sunder
