#include "fracture_tools/repair/repair_seams.h"

#include <gtest/gtest.h>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "tests/fracture_tools/polygons.h"
#include "tests/fracture_tools/repair/repaired.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/ugly_meshes.h"

namespace sunder {
namespace {

using testing::as_soup;
using testing::joined;
using testing::kKeep;
using testing::make_box;
using testing::make_torus;
using testing::placed;
using testing::refused;
using testing::Repaired;
using testing::repaired;
using testing::shaken;
using testing::tells;
using testing::without;

RepairSettings keep_with(double weld_distance) { return {.mode = RepairMode::keep, .weld_distance = weld_distance}; }

TriMesh at(TriMesh mesh, double angle, const Vec3& shift) {
    mesh.positions = placed(std::move(mesh.positions), angle, shift);
    return mesh;
}

/// A box each of whose faces is a grid of its own: `cells[f]` along both sides of face f. Where two faces meet, the
/// vertices of each lie on edges of the other. Corners have UVs that are linear in the place.
TriMesh box_of_grids(const Vec3& size, const std::array<int, 6>& cells) {
    TriMesh mesh;
    for (int f = 0; f < 6; ++f) {
        const int axis = f / 2, n = cells[f];
        const bool is_high = f % 2 == 1;
        const auto base = uint32_t(mesh.positions.size());
        for (int j = 0; j <= n; ++j)
            for (int i = 0; i <= n; ++i) {
                Vec3 p;
                p[axis] = is_high, p[(axis + 1) % 3] = double(i) / n, p[(axis + 2) % 3] = double(j) / n;
                mesh.positions.push_back(p.cwiseProduct(size));
            }
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const uint32_t a = base + uint32_t(j * (n + 1) + i), b = a + 1, c = b + uint32_t(n + 1), d = c - 1;
                for (Triangle t : {Triangle{a, b, c}, Triangle{a, c, d}}) {
                    if (!is_high) testing::flip(t);
                    mesh.triangles.push_back(t);
                    mesh.triangle_material.push_back(f);
                }
            }
    }
    for (const Triangle& t : mesh.triangles)
        for (uint32_t v : t) mesh.corner_uvs.push_back(Vec2f(mesh.positions[v].head<2>().cast<float>()));
    return mesh;
}

void expect_box(const Repaired& r, double volume, double tolerance) {
    const MeshReport report = check_mesh(r.mesh);
    EXPECT_TRUE(report.is_solid()) << (report.faults.empty() ? "no volume" : report.faults[0]);
    EXPECT_EQ(report.degenerate_triangles, 0u);
    EXPECT_NEAR(report.volume, volume, tolerance * volume);
    EXPECT_FALSE(tells(r, "hole"));
    EXPECT_FALSE(tells(r, "crosses"));
}

const std::vector<std::array<int, 6>> kGrids = {{1, 1, 1, 1, 1, 2}, {1, 1, 1, 1, 3, 1}, {2, 1, 1, 1, 1, 1},
                                                {1, 2, 3, 4, 5, 6}, {2, 3, 2, 3, 2, 3}, {7, 1, 4, 1, 1, 2}};

TEST(SplitOpenEdges, vertices_on_edges_of_the_other_side_split_these_and_no_volume_is_lost) {
    for (const auto& cells : kGrids)
        for (double angle : {0.0, 0.4, 2.1})
            for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(500, -2000, 30)})
                for (const RepairSettings& settings : {kKeep, keep_with(0), keep_with(1e-4)}) {
                    const Repaired r = repaired(at(box_of_grids(Vec3(2, 1, 1), cells), angle, shift), settings);
                    // Two kilometres off, coordinates are 2e-13 m apart.
                    expect_box(r, 2, shift.isZero(0) ? 1e-14 : 2e-12);
                    EXPECT_TRUE(tells(r, "split where"));
                }
}

TEST(SplitOpenEdges, corners_have_the_uvs_of_their_place_and_triangles_their_material) {
    for (const auto& cells : kGrids) {
        const TriMesh mesh = repaired(box_of_grids(Vec3(2, 1, 1), cells), kKeep).mesh;
        ASSERT_EQ(mesh.corner_uvs.size(), 3 * mesh.triangles.size());
        for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
            for (uint32_t c = 0; c < 3; ++c) {
                const Vec3& p = mesh.positions[mesh.triangles[t][c]];
                EXPECT_LT((mesh.corner_uvs[3 * t + c] - p.head<2>().cast<float>()).norm(), 1e-6);
                const int face = mesh.triangle_material[t];
                EXPECT_EQ(p[face / 2], face % 2 == 0 ? 0 : Vec3(2, 1, 1)[face / 2]);
            }
    }
}

TEST(SplitOpenEdges, all_pieces_of_the_cut_are_closed) {
    for (const auto& cells : kGrids)
        for (double angle : {0.0, 0.4}) {
            PrefractureSettings settings;
            settings.pieces = 40;
            settings.threads = 1;
            const auto set = prefracture(at(box_of_grids(Vec3(2, 1, 1), cells), angle, Vec3::Zero()), settings, "box");
            ASSERT_TRUE(set) << set.error().text();
            double volume = 0;
            const FragmentMeshes pieces(*set);
            for (uint32_t i = 0; i < set->fragments.size(); ++i) {
                const TriMesh piece = pieces.mesh(FragmentId(i));
                EXPECT_TRUE(check_mesh(piece).is_solid());
                // Also for who reads it with equal positions as one.
                EXPECT_TRUE(
                    repaired(as_soup(piece), {.mode = RepairMode::keep, .weld_distance = 0.0}).warnings.empty());
                volume += mesh_volume(piece);
            }
            EXPECT_NEAR(volume, 2, 1e-12);
        }
}

TEST(SplitOpenEdges, a_vertex_on_a_border_that_is_a_hole_leaves_the_hole) {
    TriMesh mesh = box_of_grids(Vec3(1, 1, 1), {1, 1, 1, 1, 1, 4});
    mesh = without(mesh, {mesh.triangles.size() - 8});
    const Repaired r = repaired(mesh, kKeep);
    EXPECT_TRUE(check_mesh(r.mesh).is_solid());
    EXPECT_NEAR(mesh_volume(r.mesh), 1, 1e-14);
    EXPECT_TRUE(tells(r, "1 hole closed"));
    EXPECT_TRUE(tells(r, "split where"));
}

TEST(WeldDistance, the_gap_of_seams_is_found_whatever_its_width) {
    for (double gap : {1e-8, 1e-6, 1e-5, 1e-4})
        for (const TriMesh& whole :
             {make_torus(), make_box(Vec3(1, 0.5, 0.2)), box_of_grids(Vec3(1, 1, 1), {2, 2, 2, 2, 2, 2})})
            for (double angle : {0.0, 0.4})
                for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(40, -7, 300)}) {
                    const TriMesh mesh = at(as_soup(whole), angle, shift);
                    const Repaired r = repaired(shaken(mesh, gap, 3), kKeep);
                    const double area = mesh_area(whole);
                    EXPECT_TRUE(check_mesh(r.mesh).is_solid());
                    EXPECT_NEAR(mesh_volume(r.mesh), mesh_volume(whole), 2 * gap * area) << gap;
                    EXPECT_EQ(r.mesh.triangles.size(), whole.triangles.size());
                    EXPECT_TRUE(tells(r, "welded"));
                    EXPECT_FALSE(tells(r, "hole"));
                }
}

TEST(WeldDistance, faces_that_were_modelled_apart_meet) {
    TriMesh mesh = box_of_grids(Vec3(1, 1, 1), {3, 3, 3, 3, 3, 3});
    // Each face moved as a whole: within it nothing is open.
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        const double by = 1e-5 * double(v / 16);
        mesh.positions[v] += Vec3(by, -0.7 * by, 0.4 * by);
    }
    const Repaired r = repaired(mesh, kKeep);
    EXPECT_TRUE(check_mesh(r.mesh).is_solid());
    EXPECT_NEAR(mesh_volume(r.mesh), 1, 1e-3);
    EXPECT_TRUE(tells(r, "m apart welded (weld_distance, found)"));
}

TEST(WeldDistance, seams_whose_sides_have_other_vertices_are_welded_and_split) {
    for (const auto& cells : kGrids) {
        const Repaired r = repaired(shaken(box_of_grids(Vec3(2, 1, 1), cells), 1e-5, 8), kKeep);
        EXPECT_TRUE(check_mesh(r.mesh).is_solid());
        EXPECT_NEAR(mesh_volume(r.mesh), 2, 2e-4);
    }
}

TEST(WeldDistance, a_number_is_taken_and_0_welds_equal_positions_alone) {
    const TriMesh mesh = shaken(as_soup(make_torus()), 1e-5, 2);
    EXPECT_NE(refused(mesh, keep_with(0)).what.find("open"), std::string::npos);
    EXPECT_NE(refused(mesh, keep_with(1e-6)).what.find("open"), std::string::npos);
    const Repaired r = repaired(mesh, keep_with(1e-4));
    EXPECT_TRUE(check_mesh(r.mesh).is_solid());
    EXPECT_EQ(r.mesh.triangles.size(), make_torus().triangles.size());
    EXPECT_TRUE(tells(r, "borders up to 0.0001 m apart welded (weld_distance)"));
    EXPECT_EQ(refused(mesh, keep_with(-1)).parameter, "weld_distance");
    EXPECT_EQ(refused(mesh, keep_with(std::nan(""))).parameter, "weld_distance");
}

TEST(WeldDistance, what_is_closed_stays_as_it_is_to_the_bit) {
    for (const TriMesh& mesh :
         {make_torus(), as_soup(make_torus()), joined(make_box(), make_box(), Vec3(1 + 1e-6, 0, 0))}) {
        const TriMesh plain = repaired(mesh, keep_with(0)).mesh;
        for (const RepairSettings& settings : {kKeep, keep_with(0.05)}) {
            const Repaired r = repaired(mesh, settings);
            EXPECT_EQ(r.mesh.positions, plain.positions);
            EXPECT_EQ(r.mesh.triangles, plain.triangles);
            EXPECT_FALSE(tells(r, "welded"));
        }
    }
}

TEST(WeldDistance, holes_and_plates_are_no_seams) {
    // A narrow hole: its long sides are far apart for what they are long.
    TriMesh torus = without(make_torus(), {1900, 1000, 400, 7});
    EXPECT_TRUE(tells(repaired(torus, kKeep), "4 holes closed"));
    // Two sheets a thousandth apart that face away from one another are no body whose rim is a seam.
    TriMesh sheet = testing::make_sheet(6, [](double, double) { return 0.0; });
    TriMesh plates = joined(testing::flipped(sheet), sheet, Vec3(0, 0, 1e-3));
    EXPECT_NE(refused(plates, kKeep).what.find("open"), std::string::npos);
    // Holes among seams stay holes.
    const Repaired r = repaired(shaken(as_soup(torus), 1e-6, 5), kKeep);
    EXPECT_TRUE(tells(r, "4 holes closed"));
    EXPECT_TRUE(tells(r, "welded"));
    EXPECT_EQ(r.mesh.triangles.size(), make_torus().triangles.size());
}

TEST(SeamGap, is_the_largest_distance_between_sides_and_nothing_where_there_are_none) {
    const TriMesh mesh = shaken(as_soup(make_torus()), 1e-5, 2);
    const double gap = seam_gap(mesh, find_open_edges(mesh), 1e-9, 1e-2);
    EXPECT_GT(gap, 1e-5);
    EXPECT_LT(gap, 2 * std::sqrt(3.0) * 1e-5);
    const TriMesh sheet = testing::make_waves();
    EXPECT_EQ(seam_gap(sheet, find_open_edges(sheet), 1e-9, 1e-2), 0);
    EXPECT_EQ(seam_gap(make_torus(), {}, 1e-9, 1e-2), 0);
}

}  // namespace
}  // namespace sunder
