#include "fracture_tools/level_set.h"

#include <gtest/gtest.h>

#include <thread>

#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/support/solids.h"

namespace sunder {
namespace {

using namespace sunder::testing;

SignedDistanceGrid level_set(const TriMesh& mesh, const LevelSetSettings& settings,
                             std::vector<std::string>* warnings = nullptr) {
    std::vector<std::string> own;
    auto grid = make_level_set(mesh, settings, "mesh", warnings ? *warnings : own);
    EXPECT_TRUE(grid) << (grid ? "" : grid.error().text());
    EXPECT_TRUE(warnings || own.empty()) << own.front();
    return grid ? grid.take() : SignedDistanceGrid();
}

Error fault(const TriMesh& mesh, const LevelSetSettings& settings) {
    std::vector<std::string> warnings;
    auto grid = make_level_set(mesh, settings, "mesh", warnings);
    EXPECT_FALSE(grid);
    return grid ? Error{} : grid.error();
}

template <class Visit>
void for_nodes(const SignedDistanceGrid& grid, const Visit& visit) {
    for (size_t i = 0; i < grid.nodes[0]; ++i)
        for (size_t j = 0; j < grid.nodes[1]; ++j)
            for (size_t k = 0; k < grid.nodes[2]; ++k)
                visit(grid.node(i, j, k), double(grid.distance[grid.index(i, j, k)]));
}

double box_distance(const Vec3& x, const Vec3& half) {
    const Vec3 q = x.cwiseAbs() - half;
    return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

TEST(LevelSet, nodes_hold_the_distance_to_a_box_inside_and_out) {
    const Vec3 half(0.5, 0.3, 0.2);
    const SignedDistanceGrid grid = level_set(test::block(-half, half), {.resolution = 60});
    double near = 0, far = 0;
    for_nodes(grid, [&](const Vec3& x, double d) {
        const double exact = box_distance(x, half), error = std::abs(d - exact);
        (std::abs(exact) < 5 * grid.voxel_size ? near : far) =
            std::max(std::abs(exact) < 5 * grid.voxel_size ? near : far, error);
    });
    std::printf("box: error %.1e voxels near, %.2f voxels far\n", near / grid.voxel_size, far / grid.voxel_size);
    EXPECT_LE(near, 1e-4 * grid.voxel_size);  // rounding to single precision
    EXPECT_LE(far, 2 * grid.voxel_size);
}

TEST(LevelSet, a_far_corner_has_its_distance_too) {
    // A thin L: most of its box is far from it, beyond the band that OpenVDB fills.
    TriMesh mesh = joined(test::block({0, 0, 0}, {1, 0.05, 0.05}), test::block({0, 0, 0.1}, {0.05, 0.05, 1}));
    const SignedDistanceGrid grid = level_set(mesh, {.resolution = 100});
    const auto exact = [](const Vec3& x) {
        const auto to = [&](const Vec3& low, const Vec3& high) {
            return box_distance(x - 0.5 * (low + high), 0.5 * (high - low));
        };
        return std::min(to({0, 0, 0}, {1, 0.05, 0.05}), to({0, 0, 0.1}, {0.05, 0.05, 1}));
    };
    double most = 0, farthest = 0;
    for_nodes(grid, [&](const Vec3& x, double d) {
        most = std::max(most, std::abs(d - exact(x)));
        farthest = std::max(farthest, d);
    });
    std::printf("L: farthest %.3f m, error %.2f voxels\n", farthest, most / grid.voxel_size);
    EXPECT_GT(farthest, 0.6);
    EXPECT_LE(most, 2 * grid.voxel_size);
}

TEST(LevelSet, keeps_the_bunny) {
    const auto bunny = read_mesh(SUNDER_TEST_DATA "/bunny.obj");
    ASSERT_TRUE(bunny);
    const SignedDistanceGrid grid = level_set(*bunny, {.resolution = 128});
    const double error = std::abs(level_set_volume(grid) / mesh_volume(*bunny) - 1);
    double most = 0;
    for (const Vec3& p : bunny->positions) {  // the least of the cell's corners is no farther than the cell is wide
        const Vec3 q = (p - grid.origin) / grid.voxel_size;
        const float d = grid.distance[grid.index(size_t(q.x()), size_t(q.y()), size_t(q.z()))];
        most = std::max(most, std::abs(double(d)) / grid.voxel_size);
    }
    std::printf("bunny 128: %zu KiB, volume error %.3f %%, nodes of vertices within %.2f voxels\n",
                grid.distance.size() * 4 / 1024, 100 * error, most);
    EXPECT_LE(error, 0.002);
    EXPECT_LE(most, std::sqrt(3.0));  // the cell's diagonal
}

TEST(LevelSet, volume_converges_to_second_order) {
    const TriMesh mesh = test::ring(0.35, 0.15, 192, 96);
    double before = 1;
    for (const int resolution : {32, 64}) {
        const double error =
            std::abs(level_set_volume(level_set(mesh, {.resolution = resolution})) / mesh_volume(mesh) - 1);
        std::printf("torus %3d: volume error %.4f %%\n", resolution, 100 * error);
        EXPECT_LE(error, before / 3);
        before = error;
    }
}

TEST(LevelSet, a_cavity_is_outside) {
    const TriMesh hollow = joined(test::ball(1, 4), flipped(test::ball(0.6, 4)));
    const SignedDistanceGrid grid = level_set(hollow, {.resolution = 50});
    double most = 0;
    for_nodes(grid, [&](const Vec3& x, double d) {
        const double r = x.norm();
        const double exact = std::max(r - 1, 0.6 - r);
        most = std::max(most, std::abs(d - exact));
        EXPECT_TRUE((d < 0) == (exact < 0) || std::abs(exact) < 0.01) << r;
    });
    EXPECT_LE(most, 0.05 * 2);  // in the middle of the cavity, where the distance has its tip
}

TEST(LevelSet, parts_that_overlap_are_one_solid) {
    const TriMesh cross =
        joined(test::block({-1, -0.3, -0.3}, {1, 0.3, 0.3}), test::block({-0.3, -1, -0.3}, {0.3, 1, 0.3}));
    std::vector<std::string> warnings;
    const SignedDistanceGrid grid = level_set(cross, {.resolution = 64}, &warnings);
    for_nodes(grid, [&](const Vec3& x, double d) {
        const double exact = std::min(box_distance(x, {1, 0.3, 0.3}), box_distance(x, {0.3, 1, 0.3}));
        EXPECT_TRUE((d < 0) == (exact < 0) || std::abs(exact) < grid.voxel_size) << x.transpose();
    });
}

TEST(LevelSet, size_and_place_do_not_matter) {
    const TriMesh mesh = test::ring(0.35, 0.15, 48, 24);
    const SignedDistanceGrid one = level_set(mesh, {.resolution = 32});
    for (const double scale : {0x1p-20, 0x1p20}) {
        for (const double shift : {0.0, scale * 0x1p20}) {
            TriMesh other = mesh;
            for (Vec3& p : other.positions) p = scale * p + Vec3(shift, -shift, shift);
            const SignedDistanceGrid grid = level_set(other, {.resolution = 32});
            ASSERT_EQ(grid.nodes, one.nodes);
            float most = 0;
            for (size_t n = 0; n < grid.distance.size(); ++n)
                most = std::max(most, std::abs(grid.distance[n] / float(scale) - one.distance[n]));
            // A shift of 2^20 sizes leaves 2^-32 of the size; OpenVDB's choices of triangles may fall otherwise.
            EXPECT_LE(most, shift == 0 ? 0.f : 0.05f * float(one.voxel_size)) << scale << " " << shift;
        }
    }
}

TEST(LevelSet, the_same_bits_whoever_else_is_at_work) {
    const auto bunny = read_mesh(SUNDER_TEST_DATA "/bunny.obj");
    ASSERT_TRUE(bunny);
    const SignedDistanceGrid one = level_set(*bunny, {.resolution = 48});
    std::vector<SignedDistanceGrid> grids(4);
    {
        std::vector<std::jthread> threads;
        for (SignedDistanceGrid& grid : grids)
            threads.emplace_back([&] { grid = level_set(*bunny, {.resolution = 48}); });
    }
    for (const SignedDistanceGrid& grid : grids) EXPECT_EQ(grid.distance, one.distance);
}

TEST(LevelSet, a_sheet_is_refused_and_may_be_given_a_thickness) {
    TriMesh sheet;
    sheet.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.2}, {0, 1, 0.2}};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    const Error error = fault(sheet, {});
    EXPECT_EQ(error.code, ErrorCode::bad_input);
    EXPECT_NE(error.text().find("thickness"), std::string::npos) << error.text();

    const SignedDistanceGrid grid = level_set(sheet, {.resolution = 64, .thickness = 0.1});
    const double t = 0.1, sides = 2 + 2 * std::hypot(1, 0.2);  // and half a tube around its border
    const double volume = t * mesh_area(sheet) + sides * M_PI * t * t / 8 + M_PI * t * t * t / 6;
    EXPECT_NEAR(level_set_volume(grid), volume, 0.01 * volume);
    EXPECT_NE(fault(sheet, {.resolution = 16, .thickness = 0.1}).text().find("a voxel size of 0.05 m fits"),
              std::string::npos);
}

TEST(LevelSet, bad_meshes_are_mended_or_named) {
    std::vector<std::string> warnings;
    const TriMesh torus = make_torus();
    level_set(as_soup(torus), {.resolution = 32}, &warnings);
    TriMesh inside_out = flipped(torus);
    EXPECT_NEAR(level_set_volume(level_set(inside_out, {.resolution = 64}, &warnings)), mesh_volume(torus),
                0.01 * mesh_volume(torus));
    TriMesh holed = torus;
    holed.triangles.erase(holed.triangles.begin() + 100, holed.triangles.begin() + 104);
    warnings.clear();
    EXPECT_NEAR(level_set_volume(level_set(holed, {.resolution = 64}, &warnings)), mesh_volume(torus),
                0.01 * mesh_volume(torus));
    EXPECT_FALSE(warnings.empty());
    TriMesh bad = torus;
    bad.positions[7].x() = std::nan("");
    EXPECT_NE(fault(bad, {}).text().find("vertex 7"), std::string::npos) << fault(bad, {}).text();
    EXPECT_EQ(fault({}, {}).code, ErrorCode::bad_input);
}

TEST(LevelSet, memory_is_limited_and_the_size_that_fits_is_named) {
    const TriMesh mesh = test::block({0, 0, 0}, {1, 1, 1});
    const std::string said = fault(mesh, {.resolution = 1000}).text();
    const size_t at = said.find("a voxel size of ");
    ASSERT_NE(at, std::string::npos) << said;
    const double fits = std::stod(said.substr(at + 16));
    std::printf("%s\n", said.c_str());
    const double nodes = std::ceil(1 / fits) + 7;
    EXPECT_LE(4 * nodes * nodes * nodes, double(kMostLevelSetBytes));
    EXPECT_GE(4 * nodes * nodes * nodes, 0.6 * double(kMostLevelSetBytes)) << "no larger than it has to be";
}

TEST(LevelSet, what_is_too_thin_for_its_voxels_is_told) {
    const TriMesh plate = test::block({0, 0, 0}, {1, 1, 0.001});
    EXPECT_NE(fault(plate, {.resolution = 32}).text().find("smaller voxels"), std::string::npos);
    std::vector<std::string> warnings;
    const TriMesh fan = joined(test::block({0, 0, 0}, {1, 1, 0.2}), test::block({0, 0, 0.3}, {1, 1, 0.315}));
    level_set(fan, {.resolution = 16}, &warnings);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("thinner than two voxels"), std::string::npos) << warnings[0];
}

TEST(LevelSet, settings_out_of_range_are_refused) {
    const TriMesh mesh = make_box();
    for (const LevelSetSettings& s : {LevelSetSettings{.voxel_size = -1},
                                      {.voxel_size = std::nan("")},
                                      {.resolution = 7},
                                      {.resolution = 1001},
                                      {.thickness = -1}})
        EXPECT_EQ(fault(mesh, s).code, ErrorCode::bad_input);
}

}  // namespace
}  // namespace sunder
