// Bodies whose fragments are gathered into clusters.
#include <gtest/gtest.h>

#include "fracture_tools/fragments/prefracture.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// A box of 8 clusters flies apart: every part of it is stretched alike, and only toughness decides.
TEST(ClusterFracture, a_body_breaks_into_its_clusters_first_and_then_into_small_pieces) {
    TriMesh box;
    for (int k = 0; k < 8; ++k) box.positions.push_back(Vec3(k & 1, (k >> 1) & 1, k >> 2));
    box.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                     {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    PrefractureSettings cut;
    cut.pieces = 150;
    cut.clusters = 8;
    const FragmentSet set = prefracture(box, cut, "box").take();
    Scene scene;
    test::add_body(scene, build_simulation_mesh(set, {}).take());
    Material material;
    material.youngs_modulus = 1e6;
    material.toughness = 0.03;
    material.damping_time = 0;  // a burst in a millisecond: damping would hold back what a crack releases
    const auto solver = test::make_solver(scene);
    FrameState state = solver->initial_state({material});
    for (size_t i = 0; i < state.velocity.size(); ++i)
        state.velocity[i] = 20 * (state.position[i] - Vec3::Constant(0.5));
    SolverSettings settings;
    settings.self_collision = false;

    size_t within_first = 0, between_first = 0, most_pieces = 1, when_parted = 0;
    const auto is_within = [&](uint32_t e) { return scene.rest.edges[e].toughness_factor > 1; };
    for (int f = 0; f < 60; ++f) {
        test::advance(*solver, test::quiet_input(scene, material, 1.0 / 960), settings, state);
        most_pieces = test::count_pieces(scene.rest, state);
        if (when_parted > 0) continue;
        for (const BrokenEdge& b : state.broken) ++(is_within(b.edge) ? within_first : between_first);
        if (most_pieces >= 8) when_parted = most_pieces;
    }
    EXPECT_GE(when_parted, 8u);
    EXPECT_LE(when_parted, 16u) << "large pieces first";
    EXPECT_LT(within_first, between_first / 4);
    EXPECT_GT(most_pieces, 2 * when_parted) << "then small ones";
}

}  // namespace
}  // namespace sunder
