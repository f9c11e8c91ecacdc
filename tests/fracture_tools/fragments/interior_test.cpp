// Break surfaces that are made finer and uneven: still closed, shared, within the outer surface and free of
// self-intersections.
#include "fracture_tools/fragments/interior.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/fragments/solid_noise.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "fracture_tools/mesh/self_intersections.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/voronoi/cut_checks.h"

namespace sunder {
namespace {

using testing::fault_of_pieces;
using testing::make_box;
using testing::make_torus;

FragmentSet cut(const TriMesh& mesh, const InteriorSettings& interior, int pieces = 20, int roughness = 1,
                CutMethod method = CutMethod::voronoi, int threads = 0) {
    PrefractureSettings settings;
    settings.method = method;
    settings.pieces = pieces;
    settings.roughness = roughness;
    settings.interior = interior;
    settings.threads = threads;
    Result<FragmentSet> set = prefracture(mesh, settings, "mesh");
    EXPECT_TRUE(set) << (set ? "" : set.error().text());
    return set ? set.take() : FragmentSet();
}

TriMesh plate() { return make_box(Vec3(1, 1, 0.05)); }

std::vector<Triangle> triangles_of(const FragmentSet& set, uint32_t fragment) {
    const Fragment& f = set.fragments[fragment];
    std::vector<Triangle> out(set.outer_triangles.begin() + f.outer_begin, set.outer_triangles.begin() + f.outer_end);
    for (const Interface& i : set.interfaces)
        if (i.a.value == fragment || i.b.value == fragment)
            out.insert(out.end(), set.interface_triangles.begin() + i.triangle_begin,
                       set.interface_triangles.begin() + i.triangle_end);
    return out;
}

size_t count_self_intersections(const FragmentSet& set) {
    size_t n = 0;
    for (uint32_t f = 0; f < set.fragments.size(); ++f)
        n += self_intersections(set.vertices, triangles_of(set, f)).size();
    return n;
}

/// How far vertices of an interface lie from its plane at most, m.
double unevenness(const FragmentSet& set) {
    double most = 0;
    for (const Interface& i : set.interfaces)
        for (uint32_t t = i.triangle_begin; t < i.triangle_end; ++t)
            for (uint32_t v : set.interface_triangles[t])
                most = std::max(most, std::abs(i.normal.dot(set.vertices[v] - i.centroid)));
    return most;
}

TEST(SelfIntersections, finds_what_crosses_touches_and_folds_but_not_what_is_joined) {
    const std::vector<Vec3> p = {{0, 0, 0},     {1, 0, 0}, {0, 1, 0},     {0.2, 0.2, -1}, {0.3, 0.2, 1},
                                 {0.2, 0.3, 1}, {1, 1, 0}, {0.4, 0.4, 0}, {0.2, 0.2, 0},  {-1, 0.2, 0}};
    using Pairs = std::vector<std::pair<uint32_t, uint32_t>>;
    auto found = [&](std::vector<Triangle> t) { return self_intersections(p, t); };
    EXPECT_EQ(found({{0, 1, 2}, {3, 4, 5}}), (Pairs{{0, 1}}));
    EXPECT_EQ(found({{0, 1, 2}, {1, 6, 2}}), Pairs{});          // share an edge
    EXPECT_EQ(found({{0, 1, 2}, {2, 1, 7}}), (Pairs{{0, 1}}));  // folded back over it
    EXPECT_EQ(found({{0, 1, 2}, {0, 3, 9}}), Pairs{});          // share a vertex
    EXPECT_EQ(found({{0, 1, 2}, {8, 4, 5}}), (Pairs{{0, 1}}));  // touches
    EXPECT_EQ(found({{0, 1, 2}, {2, 1, 0}}), (Pairs{{0, 1}}));  // twice the same
    EXPECT_EQ(found({{0, 1, 2}, {7, 7, 4}}), Pairs{});          // no area
}

TEST(SolidNoise, is_smooth_bounded_and_another_one_for_another_seed) {
    double most = 0, step = 0;
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 4000; ++i) {
        const Vec3 p(0.13 * i, 0.07 * i, -0.03 * i);
        const Vec3 n = solid_noise(p, 7);
        most = std::max(most, n.cwiseAbs().maxCoeff());
        step = std::max(step, (solid_noise(p + Vec3(1e-4, 0, 0), 7) - n).norm());
        sum += n;
    }
    EXPECT_LE(most, 1);
    EXPECT_GT(most, 0.5);
    EXPECT_LT(step, 2e-3);
    EXPECT_LT(sum.norm() / 4000, 0.05);
    EXPECT_NE(solid_noise(Vec3(0.3, 0.4, 0.5), 7), solid_noise(Vec3(0.3, 0.4, 0.5), 8));
}

TEST(Interior, finer_break_surfaces_are_the_same_surfaces) {
    for (const TriMesh& mesh : {make_box(), plate(), make_torus()}) {
        const FragmentSet coarse = cut(mesh, {}), fine = cut(mesh, {.detail = 0.2});
        EXPECT_EQ(fault_of_pieces(mesh, fine), "");
        EXPECT_GT(fine.interface_triangles.size(), 4 * coarse.interface_triangles.size());
        const double longest = 0.2 * std::cbrt(mesh_volume(mesh) / double(fine.fragments.size()));
        for (const Triangle& t : fine.interface_triangles)
            for (int c = 0; c < 3; ++c)
                EXPECT_LE((fine.vertices[t[c]] - fine.vertices[t[(c + 1) % 3]]).norm(), longest);
        ASSERT_EQ(fine.interfaces.size(), coarse.interfaces.size());
        for (size_t i = 0; i < fine.interfaces.size(); ++i) {
            EXPECT_EQ(fine.interfaces[i].normal, coarse.interfaces[i].normal);
            EXPECT_NEAR(fine.interfaces[i].area, coarse.interfaces[i].area, 1e-12);
        }
        EXPECT_LE(unevenness(fine), 1e-12);
        EXPECT_EQ(count_self_intersections(fine), count_self_intersections(coarse));
    }
}

// A good triangle has no angle near 0 or 180 degrees; the cut alone leaves fans of needles.
TEST(Interior, finer_triangles_are_well_shaped) {
    const FragmentSet fine = cut(make_box(), {.detail = 0.15});
    size_t n_thin = 0;
    for (const Triangle& t : fine.interface_triangles) {
        const Vec3 &a = fine.vertices[t[0]], &b = fine.vertices[t[1]], &c = fine.vertices[t[2]];
        const double area = 0.5 * (b - a).cross(c - a).norm();
        const double sides = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
        n_thin += 4 * std::sqrt(3.0) * area / sides < 0.3;  // 1 for an equilateral one
    }
    EXPECT_LT(double(n_thin), 0.12 * double(fine.interface_triangles.size()));
}

TEST(Interior, break_surfaces_of_a_sheet_are_strips_of_few_triangles) {
    const TriMesh sheet = make_box(Vec3(1, 1, 1e-3));
    const double size = std::cbrt(1e-3 / 20);
    const FragmentSet set = cut(sheet, {.noise = 0.3});
    double length = 0;
    for (const Interface& i : set.interfaces) length += i.area / 1e-3;
    // Twice as many as edges half as long as permitted, on both sides of the sheet.
    EXPECT_LT(double(set.interface_triangles.size()), 4 * length / (0.5 * 0.5 / 4 * size));
    EXPECT_EQ(fault_of_pieces(sheet, set), "");
    PrefractureSettings fine;
    fine.pieces = 20, fine.method = CutMethod::voronoi;
    fine.interior = {.noise = 0.3, .noise_scale = 0.05};
    const Result<FragmentSet> refused = prefracture(make_box(Vec3(1, 1, 1e-11)), fine, "sheet");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().parameter, "noise_scale") << refused.error().text();
}

TEST(Interior, noise_keeps_pieces_closed_whole_and_free_of_self_intersections) {
    const InteriorSettings noise{.noise = 0.12, .noise_scale = 0.6};
    for (const TriMesh& mesh : {make_box(), plate(), make_torus()}) {
        const FragmentSet flat = cut(mesh, {.detail = 0.15}), set = cut(mesh, noise);
        EXPECT_EQ(fault_of_pieces(mesh, set), "");
        EXPECT_EQ(count_self_intersections(set), 0u);
        EXPECT_GT(unevenness(set), 0.02 * std::cbrt(mesh_volume(mesh) / 20));
        // The outer surface is where it was, to the bit: same vertices, same triangles.
        ASSERT_EQ(set.outer_triangles, flat.outer_triangles);
        for (const Triangle& t : set.outer_triangles)
            for (uint32_t v : t) EXPECT_EQ(set.vertices[v], flat.vertices[v]);
    }
}

// So large that without moving back hundreds of triangles would cross.
TEST(Interior, too_much_noise_is_taken_back_where_pieces_would_intersect) {
    const InteriorSettings wild{.noise = 0.5, .noise_scale = 0.3};
    const TriMesh mesh = make_box();
    const FragmentSet set = cut(mesh, wild);
    EXPECT_EQ(fault_of_pieces(mesh, set), "");
    EXPECT_EQ(count_self_intersections(set), 0u);
    EXPECT_GT(unevenness(set), 0.03);
    for (const Fragment& f : set.fragments) EXPECT_GT(f.volume, 0);
}

TEST(Interior, noise_goes_with_rough_cuts_and_with_tetrahedra) {
    const InteriorSettings noise{.noise = 0.08, .noise_scale = 0.5};
    const TriMesh mesh = make_box();
    const FragmentSet rough = cut(mesh, noise, 12, 6);
    EXPECT_EQ(fault_of_pieces(mesh, rough), "");
    EXPECT_EQ(count_self_intersections(rough), 0u);
    const FragmentSet tets = cut(mesh, noise, 12, 1, CutMethod::kmeans);
    EXPECT_TRUE(check_fragments(tets));
}

TEST(Interior, any_number_of_threads_gives_the_same_bits) {
    const InteriorSettings noise{.noise = 0.3, .noise_scale = 0.5};
    const FragmentSet one = cut(make_torus(), noise, 12, 1, CutMethod::voronoi, 1),
                      two = cut(make_torus(), noise, 12, 1, CutMethod::voronoi, 2);
    EXPECT_EQ(one.vertices, two.vertices);
    EXPECT_EQ(one.interface_triangles, two.interface_triangles);
}

TEST(Interior, the_rim_is_where_break_surfaces_meet_the_outer_surface) {
    const TriMesh mesh = make_box();
    const FragmentSet thin = cut(mesh, {}), wide = cut(mesh, {.detail = 0.2, .rim_width = 0.1});
    for (const FragmentSet* set : {&thin, &wide}) {
        ASSERT_EQ(set->interface_corner_rim.size(), 3 * set->interface_triangles.size());
        const double width = set == &thin ? 1e-12 : 0.1;
        size_t n_between = 0;
        for (size_t c = 0; c < set->interface_corner_rim.size(); ++c) {
            const Vec3& p = set->vertices[set->interface_triangles[c / 3][c % 3]];
            const double depth = std::max(0.0, std::min(p.minCoeff(), (Vec3::Ones() - p).minCoeff()));
            EXPECT_NEAR(set->interface_corner_rim[c], std::max(0.0, 1 - depth / width), 1e-3);
            n_between += set->interface_corner_rim[c] > 0.1 && set->interface_corner_rim[c] < 0.9;
        }
        EXPECT_EQ(n_between > 100, set == &wide);
    }
}

TEST(Interior, uvs_are_in_metres_on_every_break_surface) {
    const FragmentSet set = cut(make_box(), {.detail = 0.3});
    for (uint32_t t = 0; t < set.interface_triangles.size(); ++t)
        for (int c = 0; c < 3; ++c) {
            const double length =
                (set.vertices[set.interface_triangles[t][c]] - set.vertices[set.interface_triangles[t][(c + 1) % 3]])
                    .norm();
            const double on_uv =
                (set.interface_corner_uvs[3 * t + c] - set.interface_corner_uvs[3 * t + (c + 1) % 3]).norm();
            EXPECT_NEAR(on_uv, length, 1e-6);
        }
}

TEST(Interior, the_smooth_angle_joins_normals_of_pieces) {
    TriMesh box = make_box();
    box.corner_normals.assign(36, Vec3f::UnitZ());
    for (const double angle : {0.0, 180.0}) {
        const FragmentSet set = cut(box, {.smooth_angle = angle});
        const TriMesh piece = fragment_mesh(set, FragmentId(0));
        std::map<uint32_t, std::set<std::array<float, 3>>> at;  // normals of the break surface at a vertex
        for (size_t c = 0; c < piece.corner_normals.size(); ++c)
            if (piece.triangle_material[c / 3] == set.interior_material) {
                const Vec3f& n = piece.corner_normals[c];
                EXPECT_NEAR(n.norm(), 1, 1e-5);
                at[piece.triangles[c / 3][c % 3]].insert({n.x(), n.y(), n.z()});
            }
        size_t most = 0;
        for (const auto& [v, normals] : at) most = std::max(most, normals.size());
        if (angle == 180)
            EXPECT_EQ(most, 1u);
        else
            EXPECT_GE(most, 3u);
    }
}

TEST(Interior, colours_stay_on_the_artists_surface) {
    TriMesh box = make_box();
    for (const Triangle& t : box.triangles)
        for (uint32_t v : t)
            box.corner_colors.push_back({float(box.positions[v].x()), float(box.positions[v].y()), 0, 1});
    for (const CutMethod method : {CutMethod::voronoi, CutMethod::kmeans}) {
        const FragmentSet set = cut(box, {.detail = 0.3}, 20, 1, method);
        ASSERT_EQ(set.outer_corner_colors.size(), 3 * set.outer_triangles.size());
        for (size_t c = 0; c < set.outer_corner_colors.size(); ++c) {
            const Vec3& p = set.vertices[set.outer_triangles[c / 3][c % 3]];
            EXPECT_NEAR(set.outer_corner_colors[c][0], p.x(), 1e-5);
            EXPECT_NEAR(set.outer_corner_colors[c][1], p.y(), 1e-5);
        }
        const TriMesh piece = fragment_mesh(set, FragmentId(3));
        EXPECT_EQ(piece.corner_colors.size(), 3 * piece.triangles.size());
    }
}

}  // namespace
}  // namespace sunder
