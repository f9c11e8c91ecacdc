#include "fracture_tools/voronoi/cell_parts.h"

#include <gtest/gtest.h>

#include <numeric>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/voronoi/restricted_voronoi.h"
#include "tests/fracture_tools/shapes.h"

namespace sunder {
namespace {

using testing::flipped;
using testing::joined;
using testing::make_box;
using testing::make_torus;

CellComplex cut(const TriMesh& mesh, const std::vector<Vec3>& sites) {
    Result<RestrictedVoronoi> cells = restrict_voronoi(mesh, sites, 1);
    EXPECT_TRUE(cells && cells->is_generic());
    split_into_parts(cells->complex);
    return cells.take().complex;
}
double total(const CellComplex& complex) {
    return std::accumulate(complex.cell_volume.begin(), complex.cell_volume.end(), 0.0);
}

TEST(SplitIntoParts, a_cell_that_meets_both_arms_of_a_ring_becomes_two) {
    // Planes near y = -0.1 and 0.1: the middle cell has a piece of the ring on either side.
    const CellComplex parts =
        cut(make_torus(), {Vec3(0.01, -0.203, 0.02), Vec3(0, 0.001, 0), Vec3(0.02, 0.201, -0.01)});
    ASSERT_EQ(parts.n_cells(), 4u);
    EXPECT_NEAR(total(parts), mesh_volume(make_torus()), 1e-12);
    EXPECT_EQ(parts.cell_site[1], parts.cell_site[2]);
    EXPECT_LT(parts.cell_centroid[1].x() * parts.cell_centroid[2].x(), -0.1);
    for (const CellFace& f : parts.faces)
        if (f.neighbour != CellFace::kOutside) {
            EXPECT_LT(f.cell, f.neighbour);
        }
}

TEST(SplitIntoParts, a_hollow_stays_with_what_is_around_it_and_an_island_in_it_is_apart) {
    TriMesh mesh = joined(make_box(), flipped(make_box(Vec3::Constant(0.6))), Vec3::Constant(0.2));
    mesh = joined(mesh, make_box(Vec3::Constant(0.2)), Vec3::Constant(0.4));
    const CellComplex parts = cut(mesh, {Vec3(0.5, 0.5, 0.5)});
    ASSERT_EQ(parts.n_cells(), 2u);
    EXPECT_NEAR(parts.cell_volume[0], 1 - 0.216, 1e-12);
    EXPECT_NEAR(parts.cell_volume[1], 0.008, 1e-12);
    EXPECT_LT((parts.cell_centroid[0] - Vec3::Constant(0.5)).norm(), 1e-12);
}

TEST(SplitIntoParts, cells_beside_the_solid_go) {
    const CellComplex parts = cut(make_box(), {Vec3(0.3, 0.4, 0.5), Vec3(30, 0.1, 0.2), Vec3(0.7, 0.61, 0.5)});
    EXPECT_EQ(parts.n_cells(), 2u);
    EXPECT_NEAR(total(parts), 1, 1e-14);
}

/// Slabs across x with these widths.
CellComplex slabs(const std::vector<double>& widths) {
    CellComplex complex;
    for (size_t i = 0; i < widths.size(); ++i) {
        complex.cell_volume.push_back(widths[i]);
        complex.cell_centroid.push_back(Vec3::Zero());
    }
    complex.vertices = {Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
    for (uint32_t i = 0; i + 1 < widths.size(); ++i) complex.faces.push_back({{0, 1, 2}, i, i + 1});
    return complex;
}

TEST(MergeSmallCells, what_is_small_beside_its_neighbours_joins_one) {
    std::vector<uint32_t> label;
    EXPECT_EQ(merge_small_cells(slabs({1, 0.01, 1, 1}), 0.05, label), 3u);
    EXPECT_EQ(label, (std::vector<uint32_t>{0, 0, 1, 2}));
    EXPECT_EQ(merge_small_cells(slabs({1, 0.01, 1, 1}), 0.005, label), 4u);
    // Sizes that grow from cell to cell are no crumbs, however small the first one is.
    EXPECT_EQ(merge_small_cells(slabs({1e-4, 1e-3, 1e-2, 1e-1, 1}), 0.05, label), 5u);
    // A chain of crumbs ends up in one.
    EXPECT_EQ(merge_small_cells(slabs({1, 0.001, 0.002, 0.001, 2}), 0.05, label), 2u);
    // What rounding made flat joins in any case, what is alone stays.
    EXPECT_EQ(merge_small_cells(slabs({1, -1e-20, 1}), 0, label), 2u);
    EXPECT_EQ(merge_small_cells(slabs({1e-9}), 0.5, label), 1u);
}

TEST(MergeSmallCells, the_neighbour_with_the_largest_shared_area_takes_it) {
    CellComplex complex = slabs({1, 0.01, 1});
    complex.vertices.push_back(Vec3(0, 0, 5));
    complex.faces[1].vertices[2] = 3;  // with cell 2 five times as much
    std::vector<uint32_t> label;
    EXPECT_EQ(merge_small_cells(complex, 0.05, label), 2u);
    EXPECT_EQ(label, (std::vector<uint32_t>{0, 1, 1}));
}

}  // namespace
}  // namespace sunder
