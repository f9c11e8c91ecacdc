// Fragments that touch themselves, and sets that are not what they say.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "fracture_tools/fragments/fragment_measures.h"
#include "fracture_tools/fragments/fragments.h"
#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/tet_grid.h"

namespace sunder {
namespace {

using testing::cube_labels;
using testing::make_box;
using testing::make_tet_grid;

FragmentSet cut_grid(std::array<int, 3> cubes, uint32_t n, const std::function<uint32_t(int, int, int)>& label) {
    const TriMesh box = make_box(Vec3(cubes[0], cubes[1], cubes[2]));
    CellComplex complex = make_cell_complex(make_tet_grid(cubes));
    find_source_triangles(box, complex);
    return make_fragments(complex, cube_labels(complex, label), n, box);
}

void expect_whole(const FragmentSet& set) {
    const Status s = check_fragments(set);
    EXPECT_TRUE(s) << (s ? "" : s.error().text());
}

TEST(FragmentMesh, two_cubes_that_meet_in_an_edge_come_apart_there) {
    // Seen from above:  0 1   The two cubes of 0 share the middle edge only.
    //                   1 0
    const FragmentSet set = cut_grid({2, 2, 1}, 2, [](int x, int y, int) { return (x + y) % 2; });
    expect_whole(set);
    for (uint32_t i : {0u, 1u}) {
        const TriMesh mesh = fragment_mesh(set, FragmentId(i));
        EXPECT_EQ(mesh.positions.size(), 16u);
        EXPECT_EQ(check_mesh(mesh).n_components, 2u);
        EXPECT_NEAR(mesh_volume(mesh), 2, 1e-14);
    }
}

TEST(FragmentMesh, cubes_that_meet_in_a_corner_come_apart_there) {
    const FragmentSet set = cut_grid({2, 2, 2}, 2, [](int x, int y, int z) { return x == y && y == z ? 0 : 1; });
    expect_whole(set);
    EXPECT_EQ(fragment_mesh(set, FragmentId(0)).positions.size(), 16u);
    EXPECT_NEAR(set.fragments[1].volume, 6, 1e-13);
}

TEST(FragmentMesh, an_edge_pinched_in_the_midst_of_a_fragment_stays_manifold) {
    // Full layers above and below a chess board: the fragment goes round both ends of the pinched edge, so that parting
    // its vertices alone cannot tell the two edges apart.
    const FragmentSet set =
        cut_grid({2, 2, 3}, 3, [](int x, int y, int z) { return z != 1 || (x + y) % 2 ? 0 : 1 + x; });
    expect_whole(set);
    const TriMesh mesh = fragment_mesh(set, FragmentId(0));
    const MeshReport r = check_mesh(mesh);
    EXPECT_TRUE(r.is_solid());
    EXPECT_NEAR(r.volume, 10, 1e-13);
    EXPECT_EQ(r.degenerate_triangles, 0u);
    EXPECT_EQ(mesh.triangle_material.size(), mesh.triangles.size());
    EXPECT_EQ(mesh.corner_uvs.size(), 3 * mesh.triangles.size());
    bool has_middle = false;
    for (const Vec3& p : mesh.positions) has_middle |= p == Vec3(1, 1, 1.5);
    EXPECT_TRUE(has_middle);
}

TEST(FragmentMesh, materials_tell_outer_from_break_surfaces_and_shared_places_are_the_same_bits) {
    const FragmentSet set = cut_grid({3, 3, 3}, 27, [](int x, int y, int z) { return uint32_t((z * 3 + y) * 3 + x); });
    expect_whole(set);
    EXPECT_EQ(set.interfaces.size(), 54u);
    const TriMesh middle = fragment_mesh(set, FragmentId(13)), corner = fragment_mesh(set, FragmentId(0));
    EXPECT_EQ(std::count(middle.triangle_material.begin(), middle.triangle_material.end(), set.interior_material), 12);
    EXPECT_EQ(std::count(corner.triangle_material.begin(), corner.triangle_material.end(), set.interior_material), 6);
    for (const Interface& face : set.interfaces) {
        EXPECT_NEAR(face.area, 1, 1e-14);
        EXPECT_NEAR(face.normal.cwiseAbs().sum(), 1, 1e-14);  // along an axis
        for (uint32_t t = face.triangle_begin; t < face.triangle_end; ++t)
            for (int c = 0; c < 3; ++c) {  // UVs measure metres on the cut
                const Vec3 d =
                    set.vertices[set.interface_triangles[t][c]] - set.vertices[set.interface_triangles[t][(c + 1) % 3]];
                const Vec2f e = set.interface_corner_uvs[3 * t + c] - set.interface_corner_uvs[3 * t + (c + 1) % 3];
                EXPECT_NEAR(d.norm(), e.norm(), 1e-6);
            }
    }
}

TEST(FragmentMesh, a_piece_inside_another_has_an_interface_that_closes) {
    const FragmentSet set =
        cut_grid({3, 3, 3}, 2, [](int x, int y, int z) { return x == 1 && y == 1 && z == 1 ? 1 : 0; });
    expect_whole(set);
    ASSERT_EQ(set.interfaces.size(), 1u);
    EXPECT_NEAR(set.interfaces[0].area, 6, 1e-13);
    EXPECT_NEAR(set.interfaces[0].normal.norm(), 1, 1e-12);
    EXPECT_NEAR(set.fragments[0].volume, 26, 1e-12);
}

TEST(CheckFragments, finds_what_is_open_turned_or_wrong) {
    const FragmentSet good = cut_grid({2, 1, 1}, 2, [](int x, int, int) { return x; });
    expect_whole(good);
    FragmentSet bad = good;
    std::swap(bad.outer_triangles[0][0], bad.outer_triangles[0][1]);
    EXPECT_FALSE(check_fragments(bad));
    bad = good;
    bad.fragments[1].volume *= 1.0001;
    ASSERT_FALSE(check_fragments(bad));
    EXPECT_EQ(check_fragments(bad).error().where, "fragment 1");
    bad = good;
    bad.source_volume = 3;
    EXPECT_NE(check_fragments(bad).error().what.find("66.6"), std::string::npos);
    bad = good;
    std::swap(bad.interfaces[0].a, bad.interfaces[0].b);
    EXPECT_FALSE(check_fragments(bad));
    EXPECT_FALSE(check_fragments(FragmentSet()));
}

TEST(FragmentMeasures, a_turned_box_has_its_closed_form_moments_and_frame) {
    std::mt19937 random(5);
    for (int k = 0; k < 20; ++k) {
        const Quat turn =
            Quat(double(random() % 1000) - 500, random() % 1000, double(random() % 1000) - 500, random() % 1000)
                .normalized();
        const Vec3 shift(random() % 100, random() % 100, random() % 100), size(1, 3, 2);
        FragmentSet set;
        const TriMesh box = make_box(size);
        for (const Vec3& p : box.positions) set.vertices.push_back(turn * p + shift);
        set.outer_triangles = box.triangles;
        set.outer_material.assign(12, 0);
        set.fragments.resize(1);
        set.fragments[0].outer_end = 12;
        measure_fragments(set);
        const Fragment& f = set.fragments[0];
        EXPECT_NEAR(f.volume, 6, 1e-12);
        EXPECT_LT((f.centroid - (turn * (0.5 * size) + shift)).norm(), 1e-12);
        const Mat3 axes = turn.toRotationMatrix();
        const Mat3 moments = axes * Vec3(size.cwiseAbs2() / 12).asDiagonal() * axes.transpose();
        EXPECT_LT((f.covariance - moments).norm(), 1e-11);
        EXPECT_LT((f.radii - Vec3(1.5, 1, 0.5)).norm(), 1e-11);
        const Mat3 frame = f.orientation.toRotationMatrix();
        EXPECT_NEAR(frame.determinant(), 1, 1e-12);
        EXPECT_NEAR(std::abs(frame.col(0).dot(axes.col(1))), 1, 1e-12);
    }
}

TEST(FragmentMeasures, frames_do_not_turn_with_rounding) {
    // Moments equal but for rounding: the frame must not follow the noise.
    for (double noise : {0.0, 1e-14, -1e-14}) {
        Mat3 m = Mat3::Identity();
        m(0, 1) = m(1, 0) = noise;
        EXPECT_LT(principal_frame(m).angularDistance(Quat::Identity()), 1e-12);
        m(2, 2) = 3;  // a square prism along z
        const Mat3 frame = principal_frame(m).toRotationMatrix();
        EXPECT_LT((frame.col(0) - Vec3::UnitZ()).norm(), 1e-12);
        EXPECT_LT((frame.col(1) - Vec3::UnitX()).norm(), 1e-12);
        m(2, 2) = 0.5;  // a square plate
        EXPECT_LT((principal_frame(m).toRotationMatrix() - Mat3::Identity()).norm(), 1e-12);
    }
}

TEST(CheckFragments, names_the_first_of_several_faults_for_any_number_of_threads) {
    FragmentSet set = cut_grid({400, 1, 1}, 400, [](int x, int, int) { return uint32_t(x); });  // seven chunks
    for (const size_t i : {399, 130, 131, 200}) set.fragments[i].volume *= 1.0001;
    for (const int threads : {1, 2, 5}) {
        const Status checked = check_fragments(set, threads);
        ASSERT_FALSE(checked);
        EXPECT_EQ(checked.error().where, "fragment 130");
    }
}

}  // namespace
}  // namespace sunder
