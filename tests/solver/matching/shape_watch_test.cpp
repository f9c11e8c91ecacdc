#include "solver/matching/shape_watch.h"

#include <gtest/gtest.h>

#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

struct Watched {
    SimulationMesh rest = test::lattice_mesh({{4, 3, 12}, 0.1, 6, 1000, {}});
    LiveTopology live;
    std::vector<Mat3> F_P;
    GroupShapes shapes;
    LaneLayout layout;
    ShapeWatch watch;

    Watched() {
        build_one_rings(rest);
        F_P.assign(rest.n_particles(), Mat3::Identity());
        live.reset(rest, std::vector<uint8_t>(rest.n_edges(), 1));
        shapes.reset(rest, live, F_P);
        layout.update(live, WorkerPool(2));
    }
    bool look(size_t unit = 0) {
        return watch.look(shapes, layout, unit, UnitBlocks(layout.units()[unit].n_blocks(), nullptr));
    }
    void rebuild(const std::vector<ParticleId>& groups) {
        shapes.rebuild(rest, live, F_P, 0, F_P.size(),
                       [&](uint32_t g) { return std::ranges::find(groups, ParticleId(g)) != groups.end(); });
    }
    void flow(uint32_t g) {
        F_P[g] = Vec3(1.1, 1 / 1.1, 1).asDiagonal();
        rebuild({ParticleId(g)});
    }
    // What must be written anew: the blocks that hold one of these groups, or a particle that is in one.
    void expect_changed(const std::vector<uint32_t>& groups) const {
        const uint32_t first = LaneLayout::kLanes * watch.unit().begin_block;
        std::vector<uint8_t> lanes(watch.n_lanes()), blocks(watch.unit().n_blocks());
        for (const uint32_t g : groups) {
            lanes[layout.lane(g) - first] = 1;
            for (uint32_t s = live.begin(g); s < live.end(g); ++s)
                blocks[(layout.lane(live.member(s)) - first) / LaneLayout::kLanes] = 1;
        }
        for (size_t lane = 0; lane < lanes.size(); ++lane) EXPECT_EQ(watch.is_changed(lane), lanes[lane] != 0) << lane;
        for (size_t b = 0; b < blocks.size(); ++b) EXPECT_EQ(watch.are_rows_changed(b), blocks[b] != 0) << b;
        EXPECT_EQ(watch.is_any_changed(), !groups.empty());
    }
};

TEST(shape_watch, tells_what_changed_since_the_last_look_and_in_whose_rows_it_is) {
    Watched w;
    EXPECT_TRUE(w.look());
    std::vector<uint32_t> all(w.rest.n_particles());
    for (uint32_t g = 0; g < all.size(); ++g) all[g] = g;
    w.expect_changed(all);
    EXPECT_FALSE(w.look());
    w.expect_changed({});

    w.flow(5), w.flow(77);  // a part: of two of the 18 blocks, and of those around them
    EXPECT_FALSE(w.look());
    w.expect_changed({5, 77});
    w.flow(6);
    EXPECT_FALSE(w.look());
    w.expect_changed({6});
    EXPECT_FALSE(w.look());
    w.expect_changed({});
}

TEST(shape_watch, takes_another_unit_or_topology_for_new) {
    Watched w;
    w.look();
    std::vector<EdgeId> cut;  // in two
    const double middle = 0.6;
    for (EdgeId e(0); e < w.rest.n_edges(); ++e) {
        const Edge& edge = w.rest.edges[e];
        if ((w.rest.rest_position[edge.a].z() < middle) != (w.rest.rest_position[edge.b].z() < middle))
            cut.push_back(e);
    }
    w.rebuild(w.live.remove_edges(w.rest, cut));
    w.layout.update(w.live, WorkerPool(2));
    ASSERT_EQ(w.layout.units().size(), 2u);
    EXPECT_TRUE(w.look(0));
    EXPECT_TRUE(w.watch.is_any_changed());
    EXPECT_FALSE(w.look(0));
    EXPECT_TRUE(w.look(1));
    EXPECT_TRUE(w.watch.is_any_changed());
    EXPECT_TRUE(w.look(0));  // what it knew of it is gone
    EXPECT_TRUE(w.watch.is_any_changed());
}

}  // namespace
}  // namespace sunder
