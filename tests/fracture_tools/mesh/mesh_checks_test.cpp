#include "fracture_tools/mesh/mesh_checks.h"

#include <gtest/gtest.h>

#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using testing::flip;
using testing::flipped;
using testing::joined;
using testing::make_box;
using testing::make_torus;

bool tells(const MeshReport& report, const std::string& text) {
    for (const std::string& fault : report.faults)
        if (fault.find(text) != std::string::npos) return true;
    return false;
}

TEST(MeshChecks, a_box_is_a_solid_with_its_volume_and_area) {
    const MeshReport r = check_mesh(make_box(Vec3(1, 2, 3)));
    EXPECT_TRUE(r.is_solid());
    EXPECT_TRUE(r.faults.empty());
    EXPECT_NEAR(r.volume, 6, 1e-14);
    EXPECT_NEAR(r.area, 22, 1e-13);
    EXPECT_EQ(r.n_components, 1u);
    EXPECT_EQ(r.bounds.max, Vec3(1, 2, 3));
}

TEST(MeshChecks, volume_keeps_its_digits_far_from_the_origin) {
    TriMesh mesh = make_box();
    for (Vec3& p : mesh.positions) p += Vec3(1e6, 1e6, 1e6);
    EXPECT_NEAR(mesh_volume(mesh), 1, 1e-9);  // an ulp at 1e6 is 1e-10
}

TEST(MeshChecks, a_missing_triangle_opens_three_edges_and_tells_where) {
    TriMesh mesh = make_box();
    mesh.triangles.pop_back();
    const MeshReport r = check_mesh(mesh);
    EXPECT_EQ(r.open_edges, 3u);
    EXPECT_FALSE(r.is_solid());
    EXPECT_TRUE(tells(r, "3 open edges, first near ("));
    const Status s = require_solid(mesh, "crate");
    ASSERT_FALSE(s);
    EXPECT_EQ(s.error().code, ErrorCode::bad_input);
    EXPECT_NE(s.error().text().find("crate: the mesh is open: 3 open edges, first near (1"), std::string::npos)
        << s.error().text();
}

TEST(MeshChecks, one_turned_triangle_is_inconsistent_along_three_edges) {
    TriMesh mesh = make_box();
    flip(mesh.triangles[5]);
    const MeshReport r = check_mesh(mesh);
    EXPECT_EQ(r.inconsistent_edges, 3u);
    EXPECT_EQ(r.open_edges, 0u);
    EXPECT_FALSE(require_solid(mesh, "crate"));
}

TEST(MeshChecks, inside_out_has_negative_volume_and_is_no_solid) {
    const TriMesh mesh = flipped(make_torus());
    EXPECT_LT(check_mesh(mesh).volume, 0);
    const Status s = require_solid(mesh, "ring");
    ASSERT_FALSE(s);
    EXPECT_NE(s.error().what.find("inward"), std::string::npos);
}

TEST(MeshChecks, duplicate_triangles_and_crowded_edges_are_counted) {
    TriMesh mesh = make_box();
    mesh.triangles.push_back(mesh.triangles[3]);
    const MeshReport r = check_mesh(mesh);
    EXPECT_EQ(r.duplicate_triangles, 1u);
    EXPECT_EQ(r.non_manifold_edges, 3u);
    EXPECT_FALSE(r.is_solid());
}

TEST(MeshChecks, two_boxes_that_share_a_vertex_touch_there) {
    TriMesh mesh = joined(make_box(), make_box(), Vec3::Ones());
    for (Triangle& t : mesh.triangles)
        for (uint32_t& v : t)
            if (v == 8) v = 7;  // the second box's origin is the first one's far corner
    const MeshReport r = check_mesh(mesh);
    EXPECT_EQ(r.non_manifold_vertices, 1u);
    EXPECT_EQ(r.isolated_vertices, 1u);
    EXPECT_EQ(r.open_edges + r.non_manifold_edges, 0u);
    EXPECT_TRUE(tells(r, "touches itself, near (1 1 1)"));
}

TEST(MeshChecks, separate_parts_are_counted) {
    const MeshReport r = check_mesh(joined(make_box(), make_torus(), Vec3(3, 0, 0)));
    EXPECT_EQ(r.n_components, 2u);
    EXPECT_TRUE(r.is_solid());
}

TEST(MeshChecks, bad_numbers_are_named_and_nothing_is_computed_from_them) {
    TriMesh mesh = make_box();
    mesh.positions[6].y() = std::nan("");
    EXPECT_TRUE(tells(check_mesh(mesh), "vertex 6"));
    EXPECT_FALSE(check_mesh(mesh).is_solid());
    mesh = make_box();
    mesh.positions[2].z() = INFINITY;
    EXPECT_FALSE(require_solid(mesh, "crate"));
    mesh = make_box();
    mesh.triangles[4][1] = 99;
    EXPECT_TRUE(tells(check_mesh(mesh), "triangle 4 has vertex 99 of 8"));
}

TEST(MeshChecks, flat_and_empty_meshes_are_no_solids) {
    EXPECT_FALSE(require_solid(TriMesh(), "nothing"));
    TriMesh single;
    single.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
    single.triangles = {{0, 1, 2}};
    EXPECT_EQ(check_mesh(single).open_edges, 3u);
    TriMesh pillow = single;  // closed, but flat
    pillow.triangles.push_back({0, 2, 1});
    const MeshReport r = check_mesh(pillow);
    EXPECT_EQ(r.open_edges, 0u);
    EXPECT_EQ(r.volume, 0);
    const Status s = require_solid(pillow, "pillow");
    ASSERT_FALSE(s);
    EXPECT_NE(s.error().what.find("no volume"), std::string::npos) << s.error().what;
}

}  // namespace
}  // namespace sunder
