#include "fracture_tools/mesh_repair.h"

#include <gtest/gtest.h>

#include <set>

#include "fracture_tools/mesh_checks.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using testing::as_soup;
using testing::flip;
using testing::flipped;
using testing::joined;
using testing::make_box;
using testing::make_torus;

struct Repaired {
    TriMesh mesh;
    std::vector<std::string> warnings;
};

Repaired repaired(const TriMesh& mesh) {
    Repaired r;
    Result<TriMesh> result = repair_mesh(mesh, "mesh", r.warnings);
    EXPECT_TRUE(result) << (result ? "" : result.error().text());
    if (result) r.mesh = result.take();
    EXPECT_TRUE(check_mesh(r.mesh).is_solid());
    return r;
}

Error refused(const TriMesh& mesh) {
    std::vector<std::string> warnings;
    const Result<TriMesh> result = repair_mesh(mesh, "mesh", warnings);
    EXPECT_FALSE(result);
    return result ? Error() : result.error();
}

TEST(MeshRepair, a_mesh_in_order_passes_through_bit_for_bit) {
    const TriMesh torus = make_torus();
    const Repaired r = repaired(torus);
    EXPECT_EQ(r.mesh.triangles, torus.triangles);
    EXPECT_TRUE(r.mesh.positions == torus.positions);
    EXPECT_TRUE(r.warnings.empty());
}

TEST(MeshRepair, turned_soup_inside_out_and_doubled_triangles_give_the_same_solid) {
    const TriMesh torus = make_torus();
    const double volume = mesh_volume(torus);
    TriMesh some_turned = torus, doubled = torus;
    for (size_t t = 0; t < torus.triangles.size(); t += 20) {
        flip(some_turned.triangles[t]);
        doubled.triangles.push_back(torus.triangles[t]);
    }
    for (const TriMesh& bad : {some_turned, doubled, as_soup(torus), flipped(torus), as_soup(flipped(torus))}) {
        const Repaired r = repaired(bad);
        EXPECT_NEAR(mesh_volume(r.mesh), volume, 1e-12 * volume);
        EXPECT_EQ(r.mesh.triangles.size(), torus.triangles.size());
    }
    EXPECT_FALSE(repaired(some_turned).warnings.empty());
    EXPECT_FALSE(repaired(doubled).warnings.empty());
}

TEST(MeshRepair, small_holes_are_closed_and_told) {
    TriMesh torus = make_torus();
    const double volume = mesh_volume(torus);
    for (size_t t : {1900, 1000, 400, 7}) torus.triangles.erase(torus.triangles.begin() + t);
    const Repaired r = repaired(torus);
    EXPECT_NEAR(mesh_volume(r.mesh), volume, 1e-12 * volume);  // one triangle a hole: the same surface again
    ASSERT_FALSE(r.warnings.empty());
    EXPECT_NE(r.warnings.front().find("4 holes closed"), std::string::npos) << r.warnings.front();
}

TEST(MeshRepair, a_sheet_is_refused_as_open_with_its_edges_and_a_place) {
    TriMesh sheet;
    sheet.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    const Error e = refused(sheet);
    EXPECT_EQ(e.code, ErrorCode::bad_input);
    EXPECT_NE(e.text().find("mesh: the mesh is open: 4 boundary edges, first near ("), std::string::npos) << e.text();
}

TEST(MeshRepair, a_box_without_lid_is_refused) {
    TriMesh box = make_box();
    box.triangles.resize(10);
    EXPECT_NE(refused(box).what.find("open: 4 boundary edges"), std::string::npos);
}

TEST(MeshRepair, what_bounds_nothing_is_refused) {
    EXPECT_EQ(refused(TriMesh()).code, ErrorCode::bad_input);
    TriMesh single;
    single.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
    single.triangles = {{0, 1, 2}};
    EXPECT_NE(refused(single).what.find("3 boundary edges"), std::string::npos);
    single.triangles.push_back({0, 2, 1});
    EXPECT_EQ(refused(single).code, ErrorCode::bad_input);
    single.positions[1] = Vec3(0, 0.5, 0);  // a line
    EXPECT_EQ(refused(single).code, ErrorCode::bad_input);
    TriMesh bad = make_box();
    bad.positions[3].x() = std::nan("");
    EXPECT_NE(refused(bad).what.find("vertex 3"), std::string::npos);
}

TEST(MeshRepair, a_cavity_stays_a_cavity_however_its_shell_was_turned) {
    TriMesh cavity = make_box(Vec3::Constant(0.5));
    const TriMesh right = joined(make_box(), flipped(cavity), Vec3::Constant(0.25));
    const TriMesh wrong = joined(make_box(), cavity, Vec3::Constant(0.25));
    for (const TriMesh& mesh : {right, wrong}) EXPECT_NEAR(mesh_volume(repaired(mesh).mesh), 1 - 0.125, 1e-14);
}

TEST(MeshRepair, two_boxes_along_one_edge_come_apart) {
    TriMesh mesh = joined(make_box(), make_box(), Vec3(1, 1, 0));  // share the edge x = y = 1
    for (Triangle& t : mesh.triangles)
        for (uint32_t& v : t) {
            if (v == 8) v = 3;
            if (v == 12) v = 7;
        }
    ASSERT_EQ(check_mesh(mesh).non_manifold_edges, 1u);
    EXPECT_NEAR(mesh_volume(repaired(mesh).mesh), 2, 1e-14);
}

TEST(MeshRepair, crossing_surfaces_are_told) {
    const Repaired r = repaired(joined(make_box(), make_box(), Vec3(0.5, 0.25, 0.1)));
    ASSERT_FALSE(r.warnings.empty());
    EXPECT_NE(r.warnings.front().find("crosses itself"), std::string::npos);
}

TEST(MeshRepair, triangles_that_stay_keep_material_uvs_and_turned_normals) {
    TriMesh box = make_box();
    box.material_names = {"a", "b"};
    for (uint32_t t = 0; t < 12; ++t) {
        box.triangle_material.push_back(t % 2);
        const auto& [a, b, c] = box.triangles[t];
        const Vec3 n = (box.positions[b] - box.positions[a]).cross(box.positions[c] - box.positions[a]).normalized();
        for (uint32_t corner = 0; corner < 3; ++corner) {
            // A UV that tells triangle and vertex, whatever the order of corners becomes.
            box.corner_uvs.push_back(Vec2f(float(t), float(box.triangles[t][corner])));
            box.corner_normals.push_back(n.cast<float>());
        }
    }
    box.vertex_groups["corner"] = {7};
    TriMesh bad = flipped(box);
    bad.corner_normals.clear();
    bad.corner_uvs.clear();
    for (uint32_t t = 0; t < 12; ++t)
        for (uint32_t corner : {0, 2, 1}) {
            bad.corner_uvs.push_back(box.corner_uvs[3 * t + corner]);
            bad.corner_normals.push_back(-box.corner_normals[3 * t + corner]);
        }
    const TriMesh mesh = repaired(bad).mesh;
    ASSERT_EQ(mesh.triangles.size(), 12u);
    std::set<int> seen;
    for (uint32_t t = 0; t < 12; ++t) {
        const int source = int(mesh.corner_uvs[3 * t].x());
        seen.insert(source);
        EXPECT_EQ(mesh.triangle_material[t], source % 2);
        const auto& [a, b, c] = mesh.triangles[t];
        const Vec3 n =
            (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]).normalized();
        for (uint32_t corner = 0; corner < 3; ++corner) {
            const int vertex = int(mesh.corner_uvs[3 * t + corner].y());
            EXPECT_EQ(mesh.positions[mesh.triangles[t][corner]], box.positions[vertex]);
            EXPECT_LT((mesh.corner_normals[3 * t + corner].cast<double>() - n).norm(), 1e-6);
        }
    }
    EXPECT_EQ(seen.size(), 12u);
    ASSERT_EQ(mesh.vertex_groups.at("corner").size(), 1u);
    EXPECT_EQ(mesh.positions[mesh.vertex_groups.at("corner")[0]], Vec3(1, 1, 1));
}

}  // namespace
}  // namespace sunder
