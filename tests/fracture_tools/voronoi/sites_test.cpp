#include "fracture_tools/voronoi/sites.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/voronoi/interior_sampler.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using testing::flipped;
using testing::joined;
using testing::make_box;
using testing::make_torus;

std::vector<Vec3> sites(const TriMesh& mesh, const SiteSettings& settings) {
    Result<std::vector<Vec3>> chosen = choose_sites(mesh, settings, 1, "mesh");
    EXPECT_TRUE(chosen) << (chosen ? "" : chosen.error().text());
    return chosen ? chosen.take() : std::vector<Vec3>();
}
SiteSettings settings(SiteKind kind, int count, uint32_t seed = 0) {
    SiteSettings s;
    s.kind = kind, s.count = count, s.seed = seed;
    return s;
}
double least_distance(const std::vector<Vec3>& points) {
    double least = HUGE_VAL;
    for (size_t i = 0; i < points.size(); ++i)
        for (size_t j = 0; j < i; ++j) least = std::min(least, (points[i] - points[j]).norm());
    return least;
}

TEST(InteriorSampler, knows_inside_from_outside_and_hollows) {
    const TriMesh hollow = joined(make_box(), flipped(make_box(Vec3::Constant(0.5))), Vec3::Constant(0.25));
    const InteriorSampler boxes(hollow);
    EXPECT_TRUE(boxes.is_inside(Vec3(0.1, 0.6, 0.5)));
    EXPECT_FALSE(boxes.is_inside(Vec3(0.5, 0.6, 0.5)));
    EXPECT_FALSE(boxes.is_inside(Vec3(1.1, 0.6, 0.5)));
    const TriMesh ring = make_torus();
    const InteriorSampler torus(ring);
    RandomShares random(1);
    int inside = 0;
    for (int k = 0; k < 20000; ++k) {
        const Vec3 p = Vec3(-0.5, -0.5, -0.15) + random.in_unit_box().cwiseProduct(Vec3(1, 1, 0.3));
        const double off = std::hypot(std::hypot(p.x(), p.y()) - 0.35, p.z());
        inside += torus.is_inside(p);
        // The torus is made of flat triangles: within 4 mm of its tube anything goes.
        if (std::abs(off - 0.15) > 0.004) {
            EXPECT_EQ(torus.is_inside(p), off < 0.15);
        }
    }
    EXPECT_NEAR(inside / 20000.0 * 0.3, mesh_volume(ring), 0.01 * 0.3);  // three standard deviations
}

TEST(InteriorSampler, spreads_samples_evenly) {
    const TriMesh box = make_box(Vec3(2, 1, 0.5));
    const InteriorSampler sampler(box);
    RandomShares random(5);
    Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
    for (int k = 0; k < 10000; ++k) {
        const Vec3 p = sampler.draw(random).cwiseQuotient(Vec3(2, 1, 0.5));
        sum += p, squares += p.cwiseProduct(p);
    }
    EXPECT_LT((sum / 10000 - Vec3::Constant(0.5)).cwiseAbs().maxCoeff(), 0.012);  // four standard deviations
    EXPECT_LT((squares / 10000 - Vec3::Constant(1 / 3.0)).cwiseAbs().maxCoeff(), 0.012);
}

// Points anywhere in the box would meet this one every thousand million times.
TEST(InteriorSampler, finds_the_inside_of_a_spike_that_goes_across_its_box) {
    TriMesh spike;
    spike.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1e4, 1e4, 1e4)};
    spike.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    const InteriorSampler sampler(spike);
    RandomShares random(5);
    double lowest = 1e4, highest = 0;
    for (int k = 0; k < 2000; ++k) {
        const Vec3 p = sampler.draw(random);
        // Barycentric: along the spike, then across it where it is as thick as its end is away.
        const double along = p.z() / 1e4, left = 1 - along;
        const Vec3 across(p.x() - p.z(), p.y() - p.z(), 0);
        EXPECT_GE(across.minCoeff(), -1e-9);
        EXPECT_LE(across.sum(), left + 1e-9);
        lowest = std::min(lowest, p.z()), highest = std::max(highest, p.z());
    }
    EXPECT_LT(lowest, 500);
    EXPECT_GT(highest, 7000);
}

TEST(Sites, every_kind_gives_what_was_asked_for_in_the_solid_and_the_same_twice) {
    TriMesh mesh = make_torus();
    mesh.vertex_groups["rim"] = {0, 1, 2, 3};
    const InteriorSampler sampler(mesh);
    for (SiteKind kind :
         {SiteKind::uniform, SiteKind::poisson, SiteKind::impact, SiteKind::density, SiteKind::kmeans}) {
        SiteSettings s = settings(kind, 150, 4);
        s.points = {Vec3(0.5, 0, 0)};
        s.density_group = "rim";
        const std::vector<Vec3> first = sites(mesh, s);
        EXPECT_EQ(first.size(), 150u) << int(kind);
        for (const Vec3& p : first) EXPECT_TRUE(sampler.is_inside(p)) << int(kind);
        EXPECT_EQ(first, sites(mesh, s));
        s.seed = 5;
        EXPECT_NE(first, sites(mesh, s));
    }
}

TEST(Sites, poisson_sites_keep_their_distance) {
    const TriMesh mesh = make_box();
    // The densest packing of 200 balls in a cube has a distance of about 0.21; random sites have one of 0.02.
    EXPECT_GT(least_distance(sites(mesh, settings(SiteKind::poisson, 200))), 0.11);
    EXPECT_LT(least_distance(sites(mesh, settings(SiteKind::uniform, 200))), 0.06);
}

TEST(Sites, an_impact_makes_pieces_that_grow_with_the_distance) {
    const TriMesh mesh = make_box(Vec3::Constant(2));
    SiteSettings s = settings(SiteKind::impact, 2000);
    s.points = {Vec3(1, 1, 1)};
    s.impact_radius = 0.1;
    int shell[3] = {0, 0, 0};  // up to 0.1, 0.2 to 0.3, 0.6 to 0.7
    for (const Vec3& p : sites(mesh, s)) {
        const double d = (p - s.points[0]).norm();
        shell[0] += d<0.1, shell[1] += d> 0.2 && d<0.3, shell[2] += d> 0.6 && d < 0.7;
    }
    auto volume = [](double from, double to) { return 4.18879 * (to * to * to - from * from * from); };
    auto expected = [&](double from, double to) {  // density (1 + d / r)^-3, roughly at the middle of the shell
        double sum = 0;
        for (int k = 0; k < 100; ++k) {
            const double a = from + (to - from) * k / 100, b = from + (to - from) * (k + 1) / 100;
            sum += volume(a, b) * std::pow(1 + 0.5 * (a + b) / 0.1, -3);
        }
        return sum;
    };
    EXPECT_NEAR(double(shell[1]) / shell[0], expected(0.2, 0.3) / expected(0, 0.1),
                0.35 * expected(0.2, 0.3) / expected(0, 0.1));
    EXPECT_NEAR(double(shell[2]) / shell[1], expected(0.6, 0.7) / expected(0.2, 0.3),
                0.25 * expected(0.6, 0.7) / expected(0.2, 0.3));
}

TEST(Sites, an_impact_along_a_curve_follows_it) {
    const TriMesh mesh = make_box();
    SiteSettings s = settings(SiteKind::impact, 400);
    s.points = {Vec3(0, 0.5, 0.5), Vec3(1, 0.5, 0.5)};
    s.impact_radius = 0.02;
    auto share_in_the_middle = [&] {  // of sites near the axis, those in the middle third of it
        double near = 0, middle = 0;
        for (const Vec3& p : sites(mesh, s))
            if (std::hypot(p.y() - 0.5, p.z() - 0.5) < 0.1) ++near, middle += std::abs(p.x() - 0.5) < 1 / 6.0;
        return middle / near;
    };
    EXPECT_LT(share_in_the_middle(), 0.15);  // only the ends are hit
    s.shape = ImpactShape::curve;
    EXPECT_NEAR(share_in_the_middle(), 0.36, 0.12);  // all of it is
}

TEST(Sites, an_impact_out_of_reach_still_gives_sites) {
    SiteSettings s = settings(SiteKind::impact, 30);
    s.points = {Vec3(1000, 0, 0)};
    s.impact_radius = 1e-3;
    EXPECT_EQ(sites(make_box(), s).size(), 30u);
}

TEST(Sites, a_grid_has_about_the_wanted_number_of_cells) {
    SiteSettings s = settings(SiteKind::grid, 125);
    s.grid_jitter = 0;
    const std::vector<Vec3> cube = sites(make_box(), s);
    ASSERT_EQ(cube.size(), 125u);
    EXPECT_LT((cube[0] - Vec3::Constant(0.1)).norm(), 1e-3);
    s.grid_jitter = 1;
    double moved = 0;
    const std::vector<Vec3> rough = sites(make_box(), s);
    for (size_t i = 0; i < rough.size(); ++i) moved = std::max(moved, (rough[i] - cube[i]).cwiseAbs().maxCoeff());
    EXPECT_GT(moved, 0.08);
    EXPECT_LE(moved, 0.1 + 1e-9);
}

TEST(Sites, more_sites_lie_near_a_dense_group) {
    TriMesh mesh = make_box();
    mesh.vertex_groups["left"] = {0, 2, 4, 6};  // x = 0
    SiteSettings s = settings(SiteKind::density, 1000);
    s.density_group = "left";
    s.density_factor = 20;
    int left = 0;
    for (const Vec3& p : sites(mesh, s)) left += p.x() < 0.5;
    EXPECT_GT(left, 650);
    for (const Vec3& p : mesh.positions) mesh.vertex_attributes["painted"].push_back(float(p.x()));
    s.density_group = "painted";
    int right = 0;
    for (const Vec3& p : sites(mesh, s)) right += p.x() > 0.5;
    EXPECT_GT(right, 650);
    s.density_group = "right";
    const Result<std::vector<Vec3>> unknown = choose_sites(mesh, s, 1, "mesh");
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().parameter, "density_group");
    EXPECT_NE(unknown.error().mend.find("left"), std::string::npos);
}

TEST(Sites, points_are_taken_as_given_but_for_doubles) {
    SiteSettings s = settings(SiteKind::points, 1);
    s.points = {Vec3(0.1, 0.2, 0.3), Vec3(5, 5, 5), Vec3(0.1, 0.2, 0.3 + 1e-9), Vec3(0.9, 0.1, 0.1)};
    EXPECT_EQ(sites(make_box(), s), (std::vector<Vec3>{s.points[0], s.points[1], s.points[3]}));
    s.points.clear();
    EXPECT_EQ(choose_sites(make_box(), s, 1, "mesh").error().parameter, "points");
    s.points = {Vec3(0, std::nan(""), 0)};
    EXPECT_EQ(choose_sites(make_box(), s, 1, "mesh").error().parameter, "points");
}

TEST(Sites, settings_out_of_range_are_refused_by_name) {
    auto parameter = [](auto change) {
        SiteSettings s;
        change(s);
        const auto chosen = choose_sites(make_box(), s, 1, "mesh");
        return chosen ? std::string("accepted") : chosen.error().parameter;
    };
    EXPECT_EQ(parameter([](auto& s) { s.count = 0; }), "pieces");
    EXPECT_EQ(parameter([](auto& s) { s.impact_radius = 0; }), "impact_radius");
    EXPECT_EQ(parameter([](auto& s) { s.impact_radius = std::nan(""); }), "impact_radius");
    EXPECT_EQ(parameter([](auto& s) { s.grid_jitter = 1.5; }), "grid_jitter");
    EXPECT_EQ(parameter([](auto& s) { s.density_factor = 0.5; }), "density_factor");
}

}  // namespace
}  // namespace sunder
