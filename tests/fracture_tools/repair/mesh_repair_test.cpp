#include "fracture_tools/repair/mesh_repair.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <set>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/repair/repair_surface.h"
#include "fracture_tools/repair/repair_union.h"
#include "tests/fracture_tools/repair/repaired.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using testing::as_soup;
using testing::flip;
using testing::flipped;
using testing::joined;
using testing::kKeep;
using testing::make_box;
using testing::make_torus;
using testing::refused;
using testing::Repaired;
using testing::repaired;
using testing::tells;

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

TEST(MeshRepair, shells_in_shells_are_what_their_winding_says) {
    const TriMesh outer = make_box(), inner = make_box(Vec3::Constant(0.5)), core = make_box(Vec3::Constant(0.25));
    const Vec3 at_inner = Vec3::Constant(0.25), at_core = Vec3::Constant(0.375);
    const TriMesh hollow = joined(outer, flipped(inner), at_inner);
    EXPECT_NEAR(mesh_volume(repaired(hollow).mesh), 1 - 0.125, 1e-14);
    EXPECT_TRUE(repaired(hollow).warnings.empty());
    EXPECT_NEAR(mesh_volume(repaired(flipped(hollow)).mesh), 1 - 0.125, 1e-14) << "inside out as a whole";
    EXPECT_NEAR(mesh_volume(repaired(joined(hollow, core, at_core)).mesh), 1 - 0.125 + 1.0 / 64, 1e-14);
    const Repaired buried = repaired(joined(outer, inner, at_inner));
    EXPECT_NEAR(mesh_volume(buried.mesh), 1, 1e-14) << "solid in solid is solid";
    EXPECT_TRUE(tells(buried, "1 shell within solid matter dropped, first near (0.25 0.25 0.25)"));
    // Wound this way and that, shells are taken as solid, cavity, solid.
    TriMesh unknown = joined(joined(outer, inner, at_inner), core, at_core);
    for (size_t t = 0; t < unknown.triangles.size(); t += 2) flip(unknown.triangles[t]);
    EXPECT_NEAR(mesh_volume(repaired(unknown).mesh), 1 - 0.125 + 1.0 / 64, 1e-14);
}

TEST(MeshRepair, one_part_inside_out_is_turned_and_the_others_stay) {
    const Repaired r = repaired(joined(make_box(Vec3(1, 1, 2)), flipped(make_box()), Vec3(3, 0, 0)));
    EXPECT_NEAR(mesh_volume(r.mesh), 3, 1e-14);
    EXPECT_TRUE(tells(r, "turned outward"));
}

TEST(MeshRepair, a_sheet_with_a_thickness_keeps_its_triangles_and_uvs_on_the_outer_side) {
    TriMesh sheet;
    sheet.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    for (const Triangle& t : sheet.triangles)
        for (uint32_t v : t) sheet.corner_uvs.push_back(sheet.positions[v].head<2>().cast<float>());
    const Repaired r = repaired(sheet, {.mode = RepairMode::keep, .thickness = 0.1});
    EXPECT_NEAR(mesh_volume(r.mesh), 0.1, 1e-14);
    EXPECT_NEAR(mesh_area(r.mesh), 2 + 0.4, 1e-14);
    EXPECT_TRUE(tells(r, "1 sheet given walls of 0.1 m"));
    for (uint32_t t = 0; t < 2; ++t)
        for (uint32_t c = 0; c < 3; ++c) {
            const Vec3& p = r.mesh.positions[r.mesh.triangles[t][c]];
            EXPECT_EQ(p.z(), 0);
            EXPECT_EQ(r.mesh.corner_uvs[3 * t + c], Vec2f(p.head<2>().cast<float>()));
        }
    for (const Vec3& p : r.mesh.positions) EXPECT_TRUE(p.z() == 0 || p.z() == -0.1);
}

TEST(MeshRepair, walls_are_as_thick_as_asked_for_also_along_edges) {
    TriMesh crate = make_box();
    crate.triangles.erase(crate.triangles.begin() + 2, crate.triangles.begin() + 4);  // no lid (z = 1)
    const double volume = mesh_volume(repaired(crate, {.mode = RepairMode::keep, .thickness = 0.1}).mesh);
    // Walls go inward; below the rim the lip leans, being offset along two walls' normals alone.
    EXPECT_NEAR(volume, 1 - 0.8 * 0.8 * 0.9, 0.02);
}

TEST(MeshRepair, seams_that_rounding_opened_are_welded) {
    TriMesh torus = as_soup(make_torus());
    for (size_t v = 0; v < torus.positions.size(); ++v) torus.positions[v].x() += 1e-9 * double(v % 7);
    const Repaired r = repaired(torus);
    EXPECT_NEAR(mesh_volume(r.mesh), mesh_volume(make_torus()), 1e-7);
    EXPECT_EQ(r.mesh.triangles.size(), make_torus().triangles.size());
    EXPECT_TRUE(tells(r, "welded"));
}

TEST(MeshRepair, a_wrap_of_crossing_solids_is_their_union_and_says_what_is_lost) {
    TriMesh mesh = joined(make_box(), make_box(), Vec3(0.5, 0.25, 0.1));
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) mesh.triangle_material.push_back(t < 12 ? 0 : 1);
    mesh.material_names = {"a", "b"};
    mesh.corner_uvs.assign(72, Vec2f(0.25f, 0.75f));
    const Repaired r = repaired(mesh, {.mode = RepairMode::wrap});
    EXPECT_NEAR(mesh_volume(r.mesh), 2 - 0.5 * 0.75 * 0.9, 0.01 * 2);
    EXPECT_TRUE(tells(r, "UVs"));
    EXPECT_TRUE(tells(r, "volume 2 -> 1.6"));
    ASSERT_EQ(r.mesh.corner_uvs.size(), 3 * r.mesh.triangles.size());
    for (const Vec2f& uv : r.mesh.corner_uvs) EXPECT_LT((uv - Vec2f(0.25f, 0.75f)).norm(), 1e-6f);
    for (uint32_t t = 0; t < r.mesh.triangles.size(); ++t) {
        const Vec3& p = r.mesh.positions[r.mesh.triangles[t][0]];
        if (p.x() > 1.1) {
            EXPECT_EQ(r.mesh.triangle_material[t], 1);
        }
        if (p.x() < 0.4) {
            EXPECT_EQ(r.mesh.triangle_material[t], 0);
        }
    }
}

TEST(MeshRepair, vertex_attributes_follow_their_vertices_through_every_repair) {
    // x + 2 y + 3 z: linear, hence known wherever a vertex is.
    auto painted = [](TriMesh mesh) {
        for (const Vec3& p : mesh.positions)
            mesh.vertex_attributes["soft"].push_back(float(p.x() + 2 * p.y() + 3 * p.z()));
        return mesh;
    };
    TriMesh sheet = make_box();
    sheet.triangles.resize(10);
    TriMesh holes = make_torus();
    for (size_t t : {1900, 1000, 400, 7}) holes.triangles.erase(holes.triangles.begin() + t);
    const TriMesh crossing = joined(make_box(), make_box(), Vec3(0.5, 0.25, 0.1));
    auto largest_error = [&](const TriMesh& source, const RepairSettings& settings) {
        const TriMesh mesh = repaired(painted(source), settings).mesh;
        const auto found = mesh.vertex_attributes.find("soft");
        if (found == mesh.vertex_attributes.end() || found->second.size() != mesh.positions.size()) return 1e9;
        double worst = 0;
        for (size_t v = 0; v < mesh.positions.size(); ++v) {
            const Vec3& p = mesh.positions[v];
            worst = std::max(worst, std::abs(double(found->second[v]) - (p.x() + 2 * p.y() + 3 * p.z())));
        }
        return worst;
    };
    EXPECT_LT(largest_error(as_soup(make_torus()), kKeep), 1e-6);
    EXPECT_LT(largest_error(holes, kKeep), 1e-6);
    EXPECT_LT(largest_error(crossing, kKeep), 1e-6);
    // Inner sides and wraps lie beside the surface: by the thickness along a diagonal, by a share of the detail.
    EXPECT_LT(largest_error(sheet, {.mode = RepairMode::keep, .thickness = 0.01}), 0.01 * 6.1);
    EXPECT_LT(largest_error(crossing, {.mode = RepairMode::wrap, .wrap_detail = 0.04}), 0.02);
}

TEST(MeshRepair, settings_out_of_range_are_refused_by_name) {
    EXPECT_EQ(refused(make_box(), {.thickness = -1}).parameter, "thickness");
    EXPECT_EQ(refused(make_box(), {.thickness = std::nan("")}).parameter, "thickness");
    EXPECT_EQ(refused(make_box(), {.wrap_detail = 0}).parameter, "wrap_detail");
}

TEST(MeshRepair, refuse_mends_nothing) {
    EXPECT_NE(refused(flipped(make_box()), {.mode = RepairMode::refuse}).what.find("inward"), std::string::npos);
}

TEST(MeshRepair, stops_when_asked_at_any_stage) {
    TriMesh torn = joined(make_torus(), make_box(), Vec3(0.3, 0, 0));
    for (size_t t : {1900, 1000, 400, 7}) torn.triangles.erase(torn.triangles.begin() + t);
    for (RepairMode mode : {RepairMode::keep, RepairMode::wrap}) {
        int reports = 0;
        std::vector<std::string> warnings;
        const Progress::Callback count = [&](double, std::string_view) { return ++reports > 0; };
        ASSERT_TRUE(repair_mesh(torn, {.mode = mode}, "mesh", warnings, Progress(count)));
        ASSERT_GT(reports, 1);
        for (int stop = 1; stop <= reports; ++stop) {
            int k = 0;
            const Progress::Callback callback = [&](double, std::string_view) { return ++k < stop; };
            const auto result = repair_mesh(torn, {.mode = mode}, "mesh", warnings, Progress(callback));
            ASSERT_FALSE(result);
            EXPECT_EQ(result.error().code, ErrorCode::cancelled);
        }
    }
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

TEST(MeshRepair, solids_that_share_a_wall_become_one_and_fins_go) {
    TriMesh pair = joined(make_box(), make_box(), Vec3(1, 0, 0));
    const Repaired both = repaired(pair);
    EXPECT_NEAR(mesh_volume(both.mesh), 2, 1e-14);
    EXPECT_NEAR(mesh_area(both.mesh), 10, 1e-13) << "the wall between them is gone";
    TriMesh fin = make_box();
    fin.positions.push_back(Vec3(0.5, -0.5, -0.5));
    fin.triangles.push_back({0, 1, 8});
    const Repaired r = repaired(fin);
    EXPECT_EQ(r.mesh.triangles.size(), 12u);
    EXPECT_TRUE(tells(r, "1 triangle of walls and fins dropped, first edge near (0.5 0 0)"));
}

TEST(MeshRepair, shells_that_cross_are_united_and_keep_what_is_left_of_their_triangles) {
    TriMesh mesh = joined(make_box(), make_box(), Vec3(0.5, 0.25, 0.1));
    mesh.material_names = {"a", "b"};
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        mesh.triangle_material.push_back(t < 12 ? 0 : 1);
        for (uint32_t v : mesh.triangles[t])  // tells the place: x and y + 3 z
            mesh.corner_uvs.push_back(
                Vec2f(float(mesh.positions[v].x()), float(mesh.positions[v].y() + 3 * mesh.positions[v].z())));
    }
    const Repaired r = repaired(mesh);
    EXPECT_NEAR(mesh_volume(r.mesh), 2 - 0.5 * 0.75 * 0.9, 1e-12);
    EXPECT_TRUE(tells(r, "2 shells that cross or touch united"));
    ASSERT_EQ(r.mesh.corner_uvs.size(), 3 * r.mesh.triangles.size());
    for (uint32_t t = 0; t < r.mesh.triangles.size(); ++t)
        for (uint32_t c = 0; c < 3; ++c) {
            const Vec3& p = r.mesh.positions[r.mesh.triangles[t][c]];
            EXPECT_LT((r.mesh.corner_uvs[3 * t + c] - Vec2f(float(p.x()), float(p.y() + 3 * p.z()))).norm(), 1e-6f);
            if (p.x() > 1.01) {
                EXPECT_EQ(r.mesh.triangle_material[t], 1);
            }
            if (p.x() < 0.49) {
                EXPECT_EQ(r.mesh.triangle_material[t], 0);
            }
        }
    // The walls of a face that both have, one beside the other.
    const Repaired beside = repaired(joined(make_box(), make_box(), Vec3(1, 0.3, 0.2)));
    EXPECT_NEAR(mesh_volume(beside.mesh), 2, 1e-12);
    EXPECT_NEAR(mesh_area(beside.mesh), 12 - 2 * 0.7 * 0.8, 1e-12);
}

TEST(MeshRepair, what_crosses_the_wall_of_a_cavity_is_united_with_the_hollow_solid) {
    const TriMesh hollow = joined(make_box(), flipped(make_box(Vec3::Constant(0.5))), Vec3::Constant(0.25));
    const Repaired through = repaired(joined(hollow, make_box(Vec3(1, 0.25, 0.25)), Vec3(0.5, 0.375, 0.375)));
    EXPECT_NEAR(mesh_volume(through.mesh), 0.875 + 0.75 * 0.0625, 1e-12);
    EXPECT_TRUE(tells(through, "3 shells that cross or touch united"));
    const TriMesh half_inside = joined(hollow, make_box(Vec3::Constant(0.25)), Vec3(0.625, 0.375, 0.375));
    const Repaired inner = repaired(half_inside);
    EXPECT_NEAR(mesh_volume(inner.mesh), 0.875 + 0.125 * 0.0625, 1e-12);
    EXPECT_FALSE(tells(inner, "within solid matter"));
    const Repaired turned = repaired(flipped(half_inside));
    EXPECT_NEAR(mesh_volume(turned.mesh), 0.875 + 0.125 * 0.0625, 1e-12) << "inside out as a whole";
    // Cavities that cross are one; what is within all that crosses goes; a cavity filled by another solid is none.
    const TriMesh two_cavities = joined(hollow, flipped(make_box(Vec3::Constant(0.25))), Vec3(0.625, 0.375, 0.375));
    EXPECT_NEAR(mesh_volume(repaired(two_cavities).mesh), 0.875 - 0.125 * 0.0625, 1e-12);
    const TriMesh filled = joined(hollow, make_box(Vec3(1, 0.75, 0.75)), Vec3(0.125, 0.125, 0.125));
    EXPECT_NEAR(mesh_volume(repaired(filled).mesh), 1 + 0.125 * 0.75 * 0.75, 1e-12);
    const TriMesh block = make_box(Vec3::Constant(3));
    const Repaired buried = repaired(joined(block, joined(make_box(), make_box(), Vec3::Constant(0.5)), Vec3::Ones()));
    EXPECT_EQ(buried.mesh.triangles.size(), 12u);
    EXPECT_TRUE(tells(buried, "2 shells within solid matter dropped"));
}

TEST(MeshRepair, a_shell_that_cannot_be_united_keeps_no_others_from_it_and_is_never_left_overlapping) {
    const TriMesh boxes = joined(make_box(), make_box(), Vec3(0.5, 0.25, 0.1));
    TriMesh knot = make_torus(0.35, 0.15, 24, 12);
    for (uint32_t v = 48; v < 96; ++v) knot.positions[v] = -1.05 * knot.positions[v] + Vec3(0.01, 0.02, 0.03);
    const TriMesh tangle = joined(knot, make_torus(0.35, 0.15, 24, 12), Vec3(0.03, 0.02, 0.01));
    TriMesh mesh = joined(boxes, tangle, Vec3(5, 0, 0));
    const auto crossing = crossing_triangles(mesh);
    const UnionReport report = unite_shells(mesh, crossing);
    EXPECT_EQ(report.united, 2u);
    EXPECT_EQ(report.left, 2u);
    EXPECT_GT(report.first_left.x(), 4);
    const Error e = refused(joined(boxes, tangle, Vec3(5, 0, 0)));
    EXPECT_NE(e.what.find("2 shells overlap and cannot be united, first near ("), std::string::npos) << e.text();
    const Repaired wrapped = repaired(joined(boxes, tangle, Vec3(5, 0, 0)), {});
    EXPECT_TRUE(tells(wrapped, "made anew"));
}

TEST(MeshRepair, a_union_has_no_edges_that_floats_cannot_tell) {
    const Eigen::AngleAxisd turn(0.6, Vec3(0.2, 0.3, 0.4).normalized());
    TriMesh mesh;
    for (int k = 0; k < 3; ++k) {  // faces in one plane but for the rounding of their corners
        TriMesh cube = make_box(Vec3::Constant(1.4));
        for (Vec3& p : cube.positions) p = (0.4 * (turn * (p + k * Vec3(0.8, 0, 0)))).cast<float>().cast<double>();
        mesh = joined(mesh, cube);
    }
    const TriMesh united = repaired(mesh).mesh;
    for (const Triangle& t : united.triangles)
        for (int c = 0; c < 3; ++c)
            EXPECT_FALSE(united.positions[t[c]].cast<float>() == united.positions[t[(c + 1) % 3]].cast<float>());
}

TEST(MeshRepair, solids_that_touch_along_an_edge_stay_two) {
    TriMesh mesh = joined(make_box(), make_box(), Vec3(1, 1, 0.5));  // half of an edge each
    EXPECT_EQ(unite_shells(mesh, crossing_triangles(mesh)).left, 0u);
    EXPECT_NEAR(mesh_volume(repaired(mesh).mesh), 2, 1e-12);
}

TEST(MeshRepair, a_surface_that_crosses_itself_is_told) {
    TriMesh torus = make_torus(0.35, 0.15, 24, 12);
    torus.positions[60] *= -1.1;
    const Repaired r = repaired(torus);
    EXPECT_TRUE(tells(r, "crosses or touches itself"));
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
            box.corner_colors.push_back({float(t), float(box.triangles[t][corner]), 0, 1});
        }
    }
    box.vertex_groups["corner"] = {7};
    TriMesh bad = flipped(box);
    bad.corner_normals.clear();
    bad.corner_uvs.clear();
    bad.corner_colors.clear();
    for (uint32_t t = 0; t < 12; ++t)
        for (uint32_t corner : {0, 2, 1}) {
            bad.corner_uvs.push_back(box.corner_uvs[3 * t + corner]);
            bad.corner_colors.push_back(box.corner_colors[3 * t + corner]);
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
            EXPECT_EQ(mesh.corner_colors[3 * t + corner], (Color{float(source), float(vertex), 0, 1}));
            EXPECT_LT((mesh.corner_normals[3 * t + corner].cast<double>() - n).norm(), 1e-6);
        }
    }
    EXPECT_EQ(seen.size(), 12u);
    ASSERT_EQ(mesh.vertex_groups.at("corner").size(), 1u);
    EXPECT_EQ(mesh.positions[mesh.vertex_groups.at("corner")[0]], Vec3(1, 1, 1));
}

}  // namespace
}  // namespace sunder
