#include "fracture_tools/lattice.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <map>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/fragments/simulation_mesh_builder.h"

namespace sunder {
namespace {

LatticeSettings bar(int neighbours) {
    LatticeSettings settings;
    settings.size = Vec3(0.2, 0.2, 1.0);
    settings.cells = {4, 4, 20};
    settings.center = Vec3(3, -2, 0.5);
    settings.neighbours = neighbours;
    return settings;
}

FragmentSet made(const LatticeSettings& settings) {
    Result<FragmentSet> set = make_lattice(settings, "bar");
    EXPECT_TRUE(set) << (set ? "" : set.error().text());
    return set ? set.take() : FragmentSet();
}

TEST(Lattice, neighbour_counts_follow_the_closed_form) {
    // Faces: nx ny nz (3 - 1/nx - 1/ny - 1/nz); edges add two diagonals a square, corners four a cube.
    const size_t faces = 3 * 4 * 20 * 2 + 4 * 4 * 19;
    const size_t edges = 2 * (3 * 3 * 20 + 2 * 3 * 4 * 19), corners = 4 * 3 * 3 * 19;
    EXPECT_EQ(made(bar(6)).interfaces.size(), faces);
    EXPECT_EQ(made(bar(18)).interfaces.size(), faces + edges);
    EXPECT_EQ(made(bar(26)).interfaces.size(), faces + edges + corners);
    // The paper's Fig. 4 bar: 320 particles; it counts 1,888 group memberships: each edge twice, each particle once.
    const FragmentSet set = made(bar(6));
    EXPECT_EQ(set.fragments.size(), 320u);
    EXPECT_EQ(2 * set.interfaces.size() + set.fragments.size(), 1888u);
}

TEST(Lattice, moments_are_those_of_a_box_in_closed_form_even_far_from_the_origin) {
    LatticeSettings settings = bar(6);
    settings.size = Vec3(0.2, 0.4, 3.0);  // cells 0.05 x 0.1 x 0.15
    settings.center = Vec3(100, 200, -50);
    const Vec3 cell(0.05, 0.1, 0.15);
    const FragmentSet set = made(settings);
    double volume = 0;
    for (size_t i = 0; i < set.fragments.size(); ++i) {
        const Fragment& f = set.fragments[i];
        volume += f.volume;
        // 1e-10: corners 200 m away have an ulp of 3e-14, the smallest cell side is 0.05.
        EXPECT_NEAR(f.volume, cell.prod(), 1e-10 * cell.prod());
        const Vec3 expected = settings.center - 0.5 * settings.size +
                              cell.cwiseProduct(Vec3(i % 4 + 0.5, i / 4 % 4 + 0.5, int(i / 16) + 0.5));
        EXPECT_LT((f.centroid - expected).norm(), 1e-11);
        const Mat3 moments = Vec3(cell.cwiseAbs2() / 12).asDiagonal();
        EXPECT_LT((f.covariance - moments).norm(), 1e-10 * moments.norm());
        // Longest axis first: z, y, x.
        EXPECT_LT((f.radii - Vec3(0.075, 0.05, 0.025)).norm(), 1e-10);
    }
    EXPECT_NEAR(volume, settings.size.prod(), 1e-11 * settings.size.prod());
    EXPECT_DOUBLE_EQ(set.source_volume, settings.size.prod());
}

TEST(Lattice, cubes_lie_along_the_axes_although_their_moments_fix_no_frame) {
    for (const Fragment& f : made(bar(6)).fragments) {
        EXPECT_LT(f.orientation.angularDistance(Quat::Identity()), 1e-9);
        EXPECT_LT((f.radii - Vec3::Constant(0.025)).norm(), 1e-12);
    }
}

TEST(Lattice, every_cell_is_closed_and_neighbours_share_its_squares) {
    for (int neighbours : {6, 18, 26}) {
        const FragmentSet set = made(bar(neighbours));
        const Status checked = check_fragments(set);
        EXPECT_TRUE(checked) << (checked ? "" : checked.error().text());
        EXPECT_EQ(fragment_mesh(set, FragmentId(37)).triangles.size(), 12u);
    }
}

TEST(Lattice, interfaces_point_from_a_to_b_and_diagonal_ones_have_no_area) {
    const FragmentSet set = made(bar(26));
    for (const Interface& face : set.interfaces) {
        const Vec3 across = set.fragments[face.b.index()].centroid - set.fragments[face.a.index()].centroid;
        EXPECT_GT(face.normal.dot(across), 0.999 * across.norm());
        const bool is_face = across.norm() < 0.06;  // side 0.05, diagonals from 0.07
        EXPECT_NEAR(face.area, is_face ? 0.0025 : 0.0, 1e-14);
        EXPECT_EQ(face.triangle_end - face.triangle_begin, is_face ? 2u : 0u);
    }
}

TEST(Lattice, one_cell_alone_has_no_interface) {
    LatticeSettings settings;
    settings.cells = {1, 1, 1};
    settings.neighbours = 26;
    const FragmentSet set = made(settings);
    EXPECT_EQ(set.interfaces.size(), 0u);
    EXPECT_TRUE(check_fragments(set));
}

TEST(Lattice, refuses_what_is_no_lattice) {
    auto refused = [](auto change) {
        LatticeSettings settings = bar(6);
        change(settings);
        const Result<FragmentSet> set = make_lattice(settings, "bar");
        return !set && set.error().code == ErrorCode::bad_input && set.error().where == "bar";
    };
    EXPECT_TRUE(refused([](auto& s) { s.size.x() = 0; }));
    EXPECT_TRUE(refused([](auto& s) { s.size.y() = std::nan(""); }));
    EXPECT_TRUE(refused([](auto& s) { s.center.z() = INFINITY; }));
    EXPECT_TRUE(refused([](auto& s) { s.cells[2] = 0; }));
    EXPECT_TRUE(refused([](auto& s) { s.cells = {1000, 1000, 1000}; }));
    EXPECT_TRUE(refused([](auto& s) { s.neighbours = 8; }));
}

}  // namespace
}  // namespace sunder
