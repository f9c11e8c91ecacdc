#include "fracture_tools/cells/label_repair.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/fracture_tools/tet_grid.h"

namespace sunder {
namespace {

using testing::cube_labels;
using testing::make_tet_grid;

/// Number of sets of cells that hang together and have one label.
size_t count_parts(const CellComplex& complex, const std::vector<uint32_t>& label) {
    std::vector<uint32_t> part(label.size());
    std::iota(part.begin(), part.end(), 0u);
    std::function<uint32_t(uint32_t)> root = [&](uint32_t i) { return part[i] == i ? i : part[i] = root(part[i]); };
    for (const CellFace& f : complex.faces)
        if (f.neighbour != CellFace::kOutside && label[f.cell] == label[f.neighbour])
            part[root(f.cell)] = root(f.neighbour);
    std::set<uint32_t> roots;
    for (uint32_t i = 0; i < label.size(); ++i) roots.insert(root(i));
    return roots.size();
}

TEST(CellComplex, faces_of_a_grid_pair_up_and_volumes_are_those_of_its_tetrahedra) {
    const CellComplex complex = make_cell_complex(make_tet_grid({3, 2, 1}));
    EXPECT_EQ(complex.n_cells(), 36u);
    size_t outer = 0;
    for (const CellFace& f : complex.faces) {
        if (f.neighbour == CellFace::kOutside)
            ++outer;
        else
            EXPECT_LT(f.cell, f.neighbour);
        // Outward: away from the cell's centroid.
        const auto& [a, b, c] = f.vertices;
        const Vec3 n = (complex.vertices[b] - complex.vertices[a]).cross(complex.vertices[c] - complex.vertices[a]);
        EXPECT_GT(n.dot(complex.vertices[a] - complex.cell_centroid[f.cell]), 0);
    }
    EXPECT_EQ(outer, 2u * 2 * (3 * 2 + 2 * 1 + 3 * 1));
    EXPECT_EQ(2 * complex.faces.size() - outer, 4 * 36u);
    for (double v : complex.cell_volume) EXPECT_NEAR(v, 1.0 / 6, 1e-15);
    EXPECT_EQ(CellFaceLists(complex).face.size(), 4 * 36u);
}

TEST(CellComplex, crumbs_are_left_out_but_never_the_largest_part) {
    TetMesh mesh = make_tet_grid({2, 1, 1});
    const auto base = static_cast<uint32_t>(mesh.vertices.size());
    for (const Vec3& p : {Vec3(5, 0, 0), Vec3(5.1, 0, 0), Vec3(5, 0.1, 0), Vec3(5, 0, 0.1)}) mesh.vertices.push_back(p);
    mesh.tets.push_back({base, base + 1, base + 2, base + 3});
    TetMesh kept = mesh;
    EXPECT_EQ(drop_crumbs(kept, 1e-5).size(), 0u);
    EXPECT_EQ(kept.tets.size(), 13u);
    EXPECT_EQ(drop_crumbs(kept, 1e-3).size(), 1u);
    EXPECT_EQ(kept.tets.size(), 12u);
    EXPECT_EQ(drop_crumbs(kept, 100).size(), 0u);
}

TEST(LabelRepair, good_labels_stay_as_they_are) {
    const CellComplex complex = make_cell_complex(make_tet_grid({4, 2, 2}));
    std::vector<uint32_t> label = cube_labels(complex, [](int x, int, int) { return x / 2; });
    const std::vector<uint32_t> before = label;
    const LabelRepair r = repair_labels(complex, 2, label);
    EXPECT_EQ(r.n_labels, 2u);
    EXPECT_EQ(r.pinched_edges, 0u);
    EXPECT_EQ(label, before);
}

TEST(LabelRepair, the_smaller_part_of_a_label_joins_its_neighbour) {
    const CellComplex complex = make_cell_complex(make_tet_grid({6, 1, 1}));
    // 0 0 0 1 1 0: the single cube of 0 at the end can only go to 1.
    std::vector<uint32_t> label = cube_labels(complex, [](int x, int, int) { return x < 3 || x == 5 ? 0 : 1; });
    EXPECT_EQ(repair_labels(complex, 2, label).n_labels, 2u);
    EXPECT_EQ(label, cube_labels(complex, [](int x, int, int) { return x < 3 ? 0 : 1; }));
}

TEST(LabelRepair, a_label_that_only_touches_itself_along_edges_is_cured) {
    const CellComplex complex = make_cell_complex(make_tet_grid({6, 6, 6}));
    // Blocks of 2^3 cubes, coloured like a chess board with two colours: every inner block edge is pinched.
    std::vector<uint32_t> label = cube_labels(complex, [](int x, int y, int z) { return (x / 2 + y / 2 + z / 2) % 2; });
    const LabelRepair r = repair_labels(complex, 20, label);
    EXPECT_EQ(r.n_labels, 20u);
    EXPECT_EQ(r.pinched_edges, 0u);
    EXPECT_EQ(count_parts(complex, label), 20u);
}

TEST(LabelRepair, labels_without_cells_get_some) {
    const CellComplex complex = make_cell_complex(make_tet_grid({3, 3, 3}));
    std::vector<uint32_t> label(complex.n_cells(), 2);
    EXPECT_EQ(repair_labels(complex, 7, label).n_labels, 7u);
    EXPECT_EQ(count_parts(complex, label), 7u);
    EXPECT_EQ(std::set<uint32_t>(label.begin(), label.end()).size(), 7u);
}

TEST(LabelRepair, there_are_never_more_labels_than_cells) {
    const CellComplex complex = make_cell_complex(make_tet_grid({1, 1, 1}));
    std::vector<uint32_t> label(6, 0);
    EXPECT_EQ(repair_labels(complex, 6, label).n_labels, 6u);
    std::vector<uint32_t> again(6, 0);
    EXPECT_EQ(repair_labels(complex, 50, again).n_labels, 6u);
}

TEST(LabelRepair, separate_parts_of_a_solid_are_separate_labels) {
    TetMesh mesh = make_tet_grid({2, 1, 1});
    const auto base = static_cast<uint32_t>(mesh.vertices.size());
    const TetMesh other = make_tet_grid({1, 1, 1});
    for (const Vec3& p : other.vertices) mesh.vertices.push_back(p + Vec3(5, 0, 0));
    for (const auto& [a, b, c, d] : other.tets) mesh.tets.push_back({a + base, b + base, c + base, d + base});
    const CellComplex complex = make_cell_complex(mesh);
    for (uint32_t wanted : {1u, 2u, 3u}) {
        std::vector<uint32_t> label(complex.n_cells(), 0);
        const LabelRepair r = repair_labels(complex, wanted, label);
        EXPECT_EQ(r.n_labels, std::max(2u, wanted));
        EXPECT_EQ(count_parts(complex, label), r.n_labels);
    }
}

}  // namespace
}  // namespace sunder
