#include "fracture_tools/cells/tetrahedralize.h"

#include <gtest/gtest.h>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/sharp_edges.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using testing::make_box;
using testing::make_torus;

double volume_of(const TetMesh& mesh) {
    double sum = 0;
    for (const auto& [a, b, c, d] : mesh.tets) {
        const double v = (mesh.vertices[b] - mesh.vertices[a])
                             .cross(mesh.vertices[c] - mesh.vertices[a])
                             .dot(mesh.vertices[d] - mesh.vertices[a]) /
                         6;
        EXPECT_GT(v, 0);
        sum += v;
    }
    return sum;
}

TEST(Tetrahedralize, sharp_edges_are_kept_where_asked_for) {
    TetrahedralizeSettings settings;
    settings.cell_size = 0.2;
    settings.surface_distance = 0.01;
    settings.sharp_angle = 40;
    const auto sharp = tetrahedralize(make_box(), settings, "box");
    ASSERT_TRUE(sharp);
    EXPECT_NEAR(volume_of(*sharp), 1, 1e-12);
    settings.sharp_angle = 0;
    const auto blunt = tetrahedralize(make_box(), settings, "box");
    ASSERT_TRUE(blunt);
    EXPECT_LT(volume_of(*blunt), 1 - 1e-6);  // its edges are cut off
}

TEST(Tetrahedralize, smaller_cells_come_closer_and_are_more) {
    const TriMesh torus = make_torus();
    double last_error = 1;
    size_t last_count = 0;
    for (double size : {0.12, 0.06, 0.03}) {
        const auto mesh = tetrahedralize(torus, {size, 0.07 * size, 0, 0}, "torus");
        ASSERT_TRUE(mesh);
        const double error = std::abs(volume_of(*mesh) / mesh_volume(torus) - 1);
        EXPECT_LT(error, last_error);
        EXPECT_GT(mesh->tets.size(), 2 * last_count);
        last_error = error, last_count = mesh->tets.size();
    }
    EXPECT_LT(last_error, 0.01);
}

TEST(Tetrahedralize, gives_the_same_bits_twice) {
    const auto a = tetrahedralize(make_torus(), {0.06, 0.004, 0, 0}, "torus"),
               b = tetrahedralize(make_torus(), {0.06, 0.004, 0, 0}, "torus");
    ASSERT_TRUE(a && b);
    EXPECT_TRUE(a->vertices == b->vertices);
    EXPECT_TRUE(a->tets == b->tets);
}

TEST(Tetrahedralize, ends_when_it_is_told_to) {
    std::atomic<bool> stop{false};
    const TetrahedralizeSettings settings{0.06, 0.004, 0, 0, &stop};
    EXPECT_TRUE(tetrahedralize(make_torus(), settings, "torus"));
    stop = true;
    EXPECT_FALSE(tetrahedralize(make_torus(), settings, "torus"));
}

TEST(Tetrahedralize, refuses_in_words_what_has_no_inside_and_what_does_not_end) {
    TriMesh sheet;
    sheet.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    EXPECT_FALSE(tetrahedralize(sheet, {0.2, 0.01, 0, 10000}, "sheet"));
    const auto endless = tetrahedralize(make_torus(), {0.01, 0.0007, 0, 500}, "torus");
    ASSERT_FALSE(endless);
    EXPECT_EQ(endless.error().code, ErrorCode::bad_input);
    EXPECT_EQ(endless.error().where, "torus");
    EXPECT_FALSE(tetrahedralize(make_box(), {0, 0.01, 0, 0}, "box"));
    EXPECT_FALSE(tetrahedralize(make_box(), {0.1, std::nan(""), 0, 0}, "box"));
}

TEST(Tetrahedralize, edges_that_cross_end_in_words_not_in_minutes) {
    const TriMesh mesh = testing::joined(make_box(), make_box(), Vec3(0.5, 0.5, 0));  // edges cross on top and below
    const auto result = tetrahedralize(mesh, {0.2, 0.01, 40, 50000}, "boxes");
    EXPECT_TRUE(result || result.error().code == ErrorCode::bad_input);
}

TEST(SharpEdges, a_box_has_them_a_torus_has_none) {
    EXPECT_GT(choose_sharp_angle(make_box(), 0.1), 0);
    EXPECT_LT(choose_sharp_angle(make_box(), 0.1), 90);
    EXPECT_EQ(choose_sharp_angle(make_torus(0.35, 0.15, 60, 40), 0.05), 0);
}

TEST(SharpEdges, a_coarse_solid_keeps_its_facets_when_cells_are_small) {
    const TriMesh coarse = make_torus(0.35, 0.15, 8, 5);
    EXPECT_GT(choose_sharp_angle(coarse, 0.02), 0);
    EXPECT_EQ(choose_sharp_angle(make_torus(0.35, 0.15, 24, 12), 0.2), 0);
}

TEST(SharpEdges, one_folded_sliver_is_a_flaw_not_a_feature) {
    TriMesh torus = make_torus(0.35, 0.15, 96, 64);
    torus.positions[100] *= 1.02;  // a dent of a few small, steep triangles
    EXPECT_EQ(choose_sharp_angle(torus, 0.05), 0);
}

}  // namespace
}  // namespace sunder
