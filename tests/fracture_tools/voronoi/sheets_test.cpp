// Sheets are cut as sheets: one fragment through the thickness, walls along it; thick bodies as ever.
#include <gtest/gtest.h>

#include <cmath>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "fracture_tools/voronoi/middle_surface.h"
#include "fracture_tools/voronoi/sites.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using testing::flipped;
using testing::joined;
using testing::make_box;
using testing::make_torus;

/// A strip of a tube about the y axis, `length` along it and as much around it; bent by `angle` (rad).
TriMesh bent_panel(double length, double angle, double thickness, int n = 24) {
    TriMesh mesh;
    const double radius = length / angle;
    for (const double side : {0.5, -0.5})
        for (int j = 0; j <= n; ++j)
            for (int i = 0; i <= n; ++i) {
                const double a = (double(i) / n - 0.5) * angle, r = radius + side * thickness;
                mesh.positions.push_back({r * std::sin(a), (double(j) / n - 0.5) * length, r * std::cos(a)});
            }
    const auto v = [&](int i, int j, int side) { return uint32_t((side * (n + 1) + j) * (n + 1) + i); };
    const auto quad = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
    };
    for (int k = 0; k < n; ++k) {
        for (int i = 0; i < n; ++i) {
            quad(v(i, k, 0), v(i + 1, k, 0), v(i + 1, k + 1, 0), v(i, k + 1, 0));
            quad(v(i, k, 1), v(i, k + 1, 1), v(i + 1, k + 1, 1), v(i + 1, k, 1));
        }
        quad(v(k, 0, 1), v(k + 1, 0, 1), v(k + 1, 0, 0), v(k, 0, 0));
        quad(v(k + 1, n, 1), v(k, n, 1), v(k, n, 0), v(k + 1, n, 0));
        quad(v(0, k + 1, 1), v(0, k, 1), v(0, k, 0), v(0, k + 1, 0));
        quad(v(n, k, 1), v(n, k + 1, 1), v(n, k + 1, 0), v(n, k, 0));
    }
    return mesh;
}
Vec3 away_from_axis(const Vec3& p) { return Vec3(p.x(), 0, p.z()).normalized(); }

std::vector<Vec3> sites(const TriMesh& mesh, SiteKind kind, int count, bool sheets = true) {
    SiteSettings s;
    s.kind = kind, s.count = count, s.seed = 3, s.sheets = sheets;
    s.points = {Vec3(0.5, 0.5, 0)}, s.density_group = "some", s.impact_radius = 1;
    Result<std::vector<Vec3>> chosen = choose_sites(mesh, s, 1, "mesh");
    EXPECT_TRUE(chosen) << (chosen ? "" : chosen.error().text());
    return chosen ? chosen.take() : std::vector<Vec3>();
}

TEST(MiddleSurface, lies_between_faces_that_look_away_from_each_other) {
    const TriMesh plate = make_box(Vec3(1, 1, 0.02));
    const MiddleSurface of_plate(plate);
    for (const double z : {1e-4, 0.004, 0.013, 0.0199, -0.001, 0.021}) {
        const auto place = of_plate.at(Vec3(0.3, 0.6, z), 0.05);
        ASSERT_TRUE(place) << z;
        EXPECT_LT((place->position - Vec3(0.3, 0.6, 0.01)).norm(), 1e-7);
        EXPECT_NEAR(place->thickness, 0.02, 1e-7);
    }
    EXPECT_FALSE(of_plate.at(Vec3(0.3, 0.6, 0.004), 0.0199));  // not so thin
    const auto by_rim = of_plate.at(Vec3(0.002, 0.6, 0.004), 0.05);
    ASSERT_TRUE(by_rim);
    EXPECT_LT((by_rim->position - Vec3(0.002, 0.6, 0.01)).norm(), 1e-7);
    // The wall of a hollow box: not across the hollow, and not the hollow.
    const TriMesh hollow = joined(make_box(), flipped(make_box(Vec3::Constant(0.9))), Vec3::Constant(0.05));
    const auto wall = MiddleSurface(hollow).at(Vec3(0.4, 0.04, 0.6), 0.5);
    ASSERT_TRUE(wall);
    EXPECT_LT((wall->position - Vec3(0.4, 0.025, 0.6)).norm(), 1e-7);
    const TriMesh arch = bent_panel(1, 1.5, 0.02);
    const auto crown = MiddleSurface(arch).at(Vec3(0.1, 0.1, std::sqrt(0.44 - 0.01)), 0.1);
    ASSERT_TRUE(crown);
    EXPECT_NEAR(std::hypot(crown->position.x(), crown->position.z()), 1 / 1.5, 0.001);  // facets 0.3 mm off the tube
    EXPECT_NEAR(crown->thickness, 0.02, 1e-4);
}

TEST(Sheets, sites_lie_in_the_middle_of_whatever_kind) {
    TriMesh plate = make_box(Vec3(1, 1, 0.02));
    plate.vertex_groups["some"] = {0, 1};
    for (SiteKind kind :
         {SiteKind::uniform, SiteKind::poisson, SiteKind::impact, SiteKind::density, SiteKind::kmeans}) {
        int off = 0;
        for (const Vec3& p : sites(plate, kind, 150)) off += std::abs(p.z() - 0.01) > 1e-5;
        EXPECT_LE(off, 6) << int(kind);  // by the rim: 0.04 of the area
        off = 0;
        for (const Vec3& p : sites(plate, kind, 150, false)) off += std::abs(p.z() - 0.01) > 1e-5;
        EXPECT_GE(off, 140) << int(kind);
    }
    for (const Vec3& p : sites(plate, SiteKind::points, 1)) EXPECT_EQ(p, Vec3(0.5, 0.5, 0));
}

// Where an impact makes pieces smaller than the plate is thick, they lie anywhere in it.
TEST(Sheets, pieces_smaller_than_the_thickness_fill_it) {
    const TriMesh plate = make_box(Vec3(1, 1, 0.04));
    SiteSettings s;
    s.kind = SiteKind::impact, s.count = 2000, s.impact_radius = 0.01;
    s.points = {Vec3(0.5, 0.5, 0.04)};
    const Result<std::vector<Vec3>> chosen = choose_sites(plate, s, 1, "mesh");
    ASSERT_TRUE(chosen);
    int near = 0, near_middle = 0, far = 0, far_middle = 0;
    for (const Vec3& p : *chosen) {
        const double from = std::hypot(p.x() - 0.5, p.y() - 0.5);
        const bool is_middle = std::abs(p.z() - 0.02) < 1e-5;
        if (from < 0.06) ++near, near_middle += is_middle;
        if (from > 0.35) ++far, far_middle += is_middle;
    }
    EXPECT_GT(near, 200);
    EXPECT_LT(near_middle, 0.1 * near);
    EXPECT_GT(far, 20);
    EXPECT_GT(far_middle, 0.6 * far);
}

TEST(Sheets, thick_bodies_keep_their_cuts) {
    const Result<TriMesh> bunny = read_mesh(SUNDER_TEST_DATA "/bunny.obj");
    ASSERT_TRUE(bunny);
    for (const TriMesh& mesh : {*bunny, make_box(), make_torus(), make_box(Vec3(1, 1, 0.3))})
        for (const int pieces : {30, 300})
            EXPECT_EQ(sites(mesh, SiteKind::kmeans, pieces), sites(mesh, SiteKind::kmeans, pieces, false)) << pieces;
}

TEST(Sheets, one_fragment_goes_through_the_thickness_and_its_walls_along_it) {
    for (const double thickness : {0.03, 0.01, 0.001}) {
        const TriMesh arch = bent_panel(1, 1.5, thickness);
        PrefractureSettings s;
        s.pieces = 300;
        const Result<FragmentSet> set = prefracture(arch, s, "arch");
        ASSERT_TRUE(set) << set.error().text();
        for (const Interface& face : set->interfaces)
            // What parts two sites on a circle goes along its radius.
            EXPECT_LT(std::abs(face.normal.dot(away_from_axis(face.centroid))), 0.05) << thickness;
        double mean = 0, squares = 0;
        for (const Fragment& f : set->fragments) mean += f.volume / 300, squares += f.volume * f.volume / 300;
        EXPECT_LT(std::sqrt(squares - mean * mean), 0.16 * mean) << thickness;  // cells are even
        EXPECT_EQ(set->fragments.size(), 300u);
    }
}

}  // namespace
}  // namespace sunder
