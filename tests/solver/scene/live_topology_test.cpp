#include "solver/scene/live_topology.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

void expect_same(const LiveTopology& a, const LiveTopology& b, size_t n) {
    ASSERT_EQ(a.n_pieces(), b.n_pieces());
    for (uint32_t g = 0; g < n; ++g) {
        ASSERT_EQ(a.count(g), b.count(g));
        ASSERT_EQ(a.piece(g), b.piece(g));
        for (uint32_t s = a.begin(g); s < a.end(g); ++s) {
            ASSERT_EQ(a.member(s), b.member(s));
            ASSERT_EQ(a.edge(s), b.edge(s));
            ASSERT_EQ(a.twin(s), b.twin(s));
        }
    }
}

// Resuming rebuilds from the edges; running removes them one by one. Both must be the same groups in the same order.
TEST(live_topology, removing_edges_equals_building_without_them) {
    const SimulationMesh rest = test::lattice_mesh({{3, 4, 5}, 0.1, 18, 1000, {}});
    std::vector<uint8_t> intact(rest.n_edges(), 1);
    LiveTopology live;
    live.reset(rest, intact);
    std::mt19937_64 rng(5);
    while (std::count(intact.begin(), intact.end(), 1) > 0) {
        std::vector<EdgeId> broken;
        for (EdgeId e(0); e < rest.n_edges(); ++e)
            if (intact[e] && rng() % 8 == 0) broken.push_back(e), intact[e] = 0;
        live.remove_edges(rest, broken);
        LiveTopology fresh;
        fresh.reset(rest, intact);
        expect_same(live, fresh, rest.n_particles());
        for (uint32_t g = 0; g < rest.n_particles(); ++g)
            for (uint32_t s = live.begin(g); s < live.end(g); ++s) {
                ASSERT_EQ(live.member(live.twin(s)), g);
                ASSERT_EQ(live.twin(live.twin(s)), s);
                ASSERT_TRUE(live.joined(g, live.member(s)));
            }
    }
    EXPECT_EQ(live.n_pieces(), rest.n_particles());
}

TEST(live_topology, counts_members_as_the_paper_counts_edges) {
    const SimulationMesh rest = test::lattice_mesh({});  // Fig. 4: 4 x 4 x 20, six neighbours
    EXPECT_EQ(rest.n_particles(), 320u);
    EXPECT_EQ(rest.n_edges(), 784u);
    EXPECT_EQ(rest.group_member.size(), 1888u);
}

}  // namespace
}  // namespace sunder
