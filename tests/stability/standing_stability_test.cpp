// What stands on a floor stands on its faces. Ellipsoids are tilted against them, reach beyond or fall short: a cube of
// 2 m that began on the floor once rose by 3 cm (Voronoi) to 12 cm (k-means) and never came to rest there.
#include <gtest/gtest.h>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "tests/support/lattice_scene.h"
#include "tests/support/solids.h"

namespace sunder {
namespace {

struct Standing : testing::TestWithParam<CutMethod> {
    Scene scene;
    Material material;
    std::unique_ptr<Solver> solver;
    FrameState state;

    void cut(const Pose& pose) {
        PrefractureSettings settings;
        settings.method = GetParam();
        settings.pieces = 40;
        const auto fragments = prefracture(test::block({-1, -1, 0}, {1, 1, 2}), settings, "cube");
        ASSERT_TRUE(fragments) << fragments.error().text();
        const auto mesh = build_simulation_mesh(*fragments, {});
        ASSERT_TRUE(mesh) << mesh.error().text();
        test::add_body(scene, *mesh, pose);
        scene.colliders.resize(1);
        scene.colliders[0].shape.kind = ShapeKind::plane;
        material.youngs_modulus = 1e8;  // its weight presses it by 0.2 mm
        solver = test::make_solver(scene);
        state = solver->initial_state({material});
    }
    void frames(int n) {
        FrameInput in = test::quiet_input(scene, material);
        in.gravity = Vec3(0, 0, -9.81);
        for (int k = 0; k < n; ++k) test::advance(*solver, in, {}, state);
    }
    /// Heights of the lowest and the highest of all corners of all fragments, m.
    std::pair<double, double> heights() const {
        const SimulationMesh& rest = solver->scene().rest;
        double low = 1e300, high = -1e300;
        for (size_t i = 0; i < state.n_particles(); ++i) {
            const Quat turn = state.orientation[i] * rest.rest_orientation[i].conjugate();
            for (const Vec3f& p : rest.hull(i)) {
                const double z = (state.position[i] + turn * p.cast<double>()).z();
                low = std::min(low, z), high = std::max(high, z);
            }
        }
        return {low, high};
    }
    double fastest() const {
        double v = 0;
        for (const Vec3& x : state.velocity) v = std::max(v, x.norm());
        return v;
    }
};

TEST_P(Standing, a_cube_that_begins_on_the_floor_stays_as_it_is) {
    cut({});
    const std::vector<Vec3> start = state.position;
    double moved = 0;
    for (int f = 0; f < 48; ++f) {
        frames(1);
        for (size_t i = 0; i < start.size(); ++i) moved = std::max(moved, (state.position[i] - start[i]).norm());
    }
    std::printf("a standing cube: moved by %.2e m at most, %.1e m/s at the end\n", moved, fastest());
    EXPECT_LE(moved, 2e-3);  // a thousandth of it: no pixel
    EXPECT_LE(fastest(), 1e-3);
}

TEST_P(Standing, a_cube_that_fell_on_an_edge_comes_to_lie_on_a_face) {
    cut({Vec3(0, 0, 0.8), Quat(Eigen::AngleAxisd(0.5, Vec3(1, 0.2, 0).normalized()))});
    frames(120);
    const auto [low, high] = heights();
    std::printf("a fallen cube: corners at %.2e to %.3f m, %.1e m/s\n", low, high, fastest());
    EXPECT_NEAR(low, 0, 0.01);   // half a per cent of it
    EXPECT_NEAR(high, 2, 0.01);  // on an edge or tilted by a degree it would be 3.5 cm higher
    EXPECT_LE(fastest(), 0.01);
}

INSTANTIATE_TEST_SUITE_P(cuts, Standing, testing::Values(CutMethod::voronoi, CutMethod::kmeans),
                         [](const auto& info) { return info.param == CutMethod::voronoi ? "voronoi" : "kmeans"; });

}  // namespace
}  // namespace sunder
