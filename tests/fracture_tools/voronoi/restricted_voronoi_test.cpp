// Hundreds of cuts of small solids, each checked against all that must hold, by brute force where that is possible.
#include "fracture_tools/voronoi/restricted_voronoi.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numeric>
#include <random>

#include "fracture_tools/fragments/fragments.h"
#include "fracture_tools/voronoi/cell_parts.h"
#include "fracture_tools/voronoi/voronoi_cutter.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/voronoi/cut_checks.h"

namespace sunder {
namespace {

using testing::fault_of_cells;
using testing::fault_of_pieces;
using testing::flipped;
using testing::joined;
using testing::make_box;
using testing::make_torus;

/// A torus whose points are moved at random: no two triangles in a plane, some folded.
TriMesh rough_torus(uint32_t seed) {
    TriMesh mesh = make_torus(0.35, 0.15, 10, 7);
    std::mt19937 random(seed);
    for (Vec3& p : mesh.positions)
        for (int k = 0; k < 3; ++k) p[k] += 0.03 * (random() / 4294967296.0 - 0.5);
    return mesh;
}

struct Solid {
    const char* name;
    TriMesh mesh;
};
std::vector<Solid> solids() {
    TriMesh tetrahedron;
    tetrahedron.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
    tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    TriMesh far_away = make_box(Vec3::Constant(1e-3));
    for (Vec3& p : far_away.positions) p += Vec3(40, -70, 25);
    return {{"cube", make_box()},
            {"plate", make_box(Vec3(1, 1, 0.02))},
            {"needle", make_box(Vec3(1, 0.01, 0.01))},
            {"tetrahedron", tetrahedron},
            {"torus", make_torus(0.35, 0.15, 12, 6)},
            {"rough torus", rough_torus(5)},
            {"hollow box", joined(make_box(), flipped(make_box(Vec3(0.5, 0.6, 0.4))), Vec3(0.2, 0.3, 0.25))},
            {"two boxes", joined(make_box(), make_box(Vec3(0.3, 1, 0.5)), Vec3(1.5, 0.2, 0))},
            {"millimetre far away", far_away}};
}

enum class Spread { uniform, clustered, grid, far_out };

std::vector<Vec3> random_sites(const TriMesh& mesh, size_t n, Spread spread, uint32_t seed) {
    std::mt19937 random(seed);
    Aabb box;
    for (const Vec3& p : mesh.positions) box.extend(p);
    auto share = [&] { return random() / 4294967296.0; };
    std::vector<Vec3> sites;
    const Vec3 middle = box.min + Vec3(share(), share(), share()).cwiseProduct(box.max - box.min);
    for (size_t i = 0; i < n; ++i) {
        Vec3 s(share(), share(), share());
        if (spread == Spread::grid) s = Vec3(i % 3, (i / 3) % 3, i / 9) / 3 + Vec3::Constant(1.0 / 6);
        if (spread == Spread::far_out) s = 5 * s - Vec3::Constant(2);
        Vec3 p = box.min + s.cwiseProduct(box.max - box.min);
        if (spread == Spread::clustered) p = middle + std::pow(0.7, double(i)) * (p - middle);
        sites.push_back(p);
    }
    return sites;
}

std::vector<uint32_t> one_each(const CellComplex& complex) {
    std::vector<uint32_t> label(complex.n_cells());
    std::iota(label.begin(), label.end(), 0u);
    return label;
}

TEST(RestrictedVoronoi, all_that_must_hold_holds_for_hundreds_of_random_cuts) {
    int cuts = 0;
    for (const Solid& solid : solids())
        for (size_t n : {1, 2, 3, 4, 7, 11, 15, 27, 40})
            for (Spread spread : {Spread::uniform, Spread::clustered, Spread::grid, Spread::far_out}) {
                const uint32_t seed = uint32_t(1000 * n + size_t(spread));
                const std::string what = std::string(solid.name) + ", " + std::to_string(n) + " sites, spread " +
                                         std::to_string(int(spread));
                std::vector<std::string> warnings;
                const std::vector<Vec3> sites = random_sites(solid.mesh, n, spread, seed);
                const Result<CellComplex> cells = cut_by_sites(solid.mesh, sites, seed, 1, "mesh", warnings);
                ASSERT_TRUE(cells) << what << ": " << cells.error().text();
                EXPECT_EQ(warnings.size(), 0u) << what << ": " << warnings[0];
                EXPECT_EQ(fault_of_cells(solid.mesh, *cells), "") << what;
                const FragmentSet set =
                    make_fragments(*cells, one_each(*cells), uint32_t(cells->n_cells()), solid.mesh);
                EXPECT_EQ(fault_of_pieces(solid.mesh, set), "") << what;
                for (double v : cells->cell_volume) EXPECT_GT(v, 0) << what;
                ++cuts;
            }
    EXPECT_GE(cuts, 300);
}

/// Sites a few bits from a grid, which is as near to degenerate as there is: filters fail by the thousand, and rational
/// numbers decide. Everything still fits together; only triangles may be thinner than doubles can tell.
TEST(RestrictedVoronoi, sites_a_few_bits_from_a_grid_are_cut_by_rational_numbers) {
    std::mt19937 random(3);
    size_t exact = 0;
    for (const TriMesh& mesh : {make_box(), make_torus(0.35, 0.15, 12, 6), make_box(Vec3(1, 1, 0.02))})
        for (double amount : {1e-9, 1e-13, 1e-15}) {
            std::vector<Vec3> sites = random_sites(mesh, 27, Spread::grid, 1);
            for (Vec3& s : sites)
                for (int k = 0; k < 3; ++k) s[k] += amount * (random() / 4294967296.0 - 0.5);
            Result<RestrictedVoronoi> cut = restrict_voronoi(mesh, sites, 1);
            ASSERT_TRUE(cut);
            if (!cut->is_generic()) continue;  // a bit or two may be just the wrong ones
            exact += cut->predicates.exact;
            EXPECT_EQ(cut->mismatches + cut->overlaps, 0u);
            split_into_parts(cut->complex);
            std::vector<uint32_t> label;
            const uint32_t n = merge_small_cells(cut->complex, 0.05, label);
            const FragmentSet set = make_fragments(cut->complex, label, n, mesh);
            EXPECT_EQ(fault_of_pieces(mesh, set), "") << "moved by " << amount;
        }
    EXPECT_GT(exact, 500u);
}

TEST(RestrictedVoronoi, an_exact_grid_is_told_as_degenerate_and_cured_by_jitter) {
    const TriMesh mesh = make_box();
    std::vector<Vec3> sites;
    for (int i = 0; i < 64; ++i) sites.push_back(Vec3(i % 4, i / 4 % 4, i / 16) / 4 + Vec3::Constant(0.125));
    const Result<RestrictedVoronoi> cut = restrict_voronoi(mesh, sites, 1);
    ASSERT_TRUE(cut);
    EXPECT_FALSE(cut->is_generic());
    EXPECT_TRUE(cut->complex.faces.empty());
    std::vector<std::string> warnings;
    const Result<CellComplex> cells = cut_by_sites(mesh, sites, 7, 1, "mesh", warnings);
    ASSERT_TRUE(cells);
    ASSERT_EQ(cells->n_cells(), 64u);
    for (double v : cells->cell_volume) EXPECT_NEAR(v, 1 / 64.0, 1e-6);
    EXPECT_EQ(fault_of_cells(mesh, *cells), "");
}

TEST(RestrictedVoronoi, gives_the_same_bits_with_any_number_of_threads) {
    const TriMesh mesh = make_torus();
    const std::vector<Vec3> sites = random_sites(mesh, 200, Spread::uniform, 9);
    auto cut = [&](int threads) {
        Result<RestrictedVoronoi> r = restrict_voronoi(mesh, sites, threads);
        EXPECT_TRUE(r);
        return r.take().complex;
    };
    const CellComplex one = cut(1);
    for (int threads : {2, 4, 7}) {
        const CellComplex many = cut(threads);
        ASSERT_EQ(many.vertices.size(), one.vertices.size());
        EXPECT_EQ(std::memcmp(many.vertices.data(), one.vertices.data(), one.vertices.size() * sizeof(Vec3)), 0);
        ASSERT_EQ(many.faces.size(), one.faces.size());
        EXPECT_EQ(std::memcmp(many.faces.data(), one.faces.data(), one.faces.size() * sizeof(CellFace)), 0);
        EXPECT_EQ(many.source_weights, one.source_weights);
    }
}

TEST(RestrictedVoronoi, triangles_that_no_cell_border_crosses_stay_as_they_are) {
    const TriMesh mesh = make_torus();
    const Result<RestrictedVoronoi> cut = restrict_voronoi(mesh, random_sites(mesh, 20, Spread::uniform, 2), 1);
    ASSERT_TRUE(cut);
    std::vector<int> parts(mesh.triangles.size(), 0);
    for (const CellFace& f : cut->complex.faces)
        if (f.neighbour == CellFace::kOutside) ++parts[f.source_triangle];
    int whole = 0;
    for (const CellFace& f : cut->complex.faces)
        if (f.neighbour == CellFace::kOutside && parts[f.source_triangle] == 1) {
            EXPECT_EQ(f.vertices, mesh.triangles[f.source_triangle]);
            ++whole;
        }
    EXPECT_GT(whole, 1000);
    for (uint32_t v = 0; v < mesh.positions.size(); ++v) EXPECT_EQ(cut->complex.vertices[v], mesh.positions[v]);
}

TEST(RestrictedVoronoi, a_surface_with_a_hole_is_told_never_cut) {
    TriMesh mesh = make_torus();
    mesh.triangles.erase(mesh.triangles.begin() + 100, mesh.triangles.begin() + 160);
    const Result<RestrictedVoronoi> cut = restrict_voronoi(mesh, random_sites(mesh, 60, Spread::uniform, 2), 1);
    ASSERT_TRUE(cut);
    EXPECT_GT(cut->mismatches, 0u);
}

TEST(RestrictedVoronoi, overlapping_solids_are_told) {
    const TriMesh mesh = joined(make_box(), make_box(), Vec3(0.4, 0.3, 0.2));
    const Result<RestrictedVoronoi> cut = restrict_voronoi(mesh, random_sites(mesh, 200, Spread::uniform, 2), 1);
    ASSERT_TRUE(cut);
    EXPECT_GT(cut->overlaps, 0u);
}

TEST(RestrictedVoronoi, two_sites_in_one_place_are_refused) {
    const Result<RestrictedVoronoi> cut = restrict_voronoi(make_box(), std::vector<Vec3>(2, Vec3(0.3, 0.4, 0.5)), 1);
    ASSERT_FALSE(cut);
    EXPECT_EQ(cut.error().code, ErrorCode::bad_input);
}

}  // namespace
}  // namespace sunder
