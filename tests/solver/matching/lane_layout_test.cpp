#include "solver/matching/lane_layout.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// Every bound particle has one lane, every membership one cell, and the neighbour there is the member's lane; what is
// left over points at itself.
void expect_whole(const SimulationMesh& rest, const LiveTopology& live, const LaneLayout& layout) {
    constexpr uint32_t kLanes = LaneLayout::kLanes;
    std::set<uint32_t> particles;
    uint32_t end_block = 0, end_row = 0;
    for (size_t u = 0; u < layout.units().size(); ++u) {
        const LaneLayout::Unit& unit = layout.units()[u];
        EXPECT_EQ(unit.begin_block, end_block);
        EXPECT_EQ(unit.begin_row, end_row);
        end_block = unit.end_block, end_row = unit.end_row;
        const uint32_t first = kLanes * unit.begin_block;
        EXPECT_EQ(layout.row_begin(u)[0], 0u);
        EXPECT_EQ(layout.row_begin(u)[unit.n_blocks()], unit.n_rows());
        for (uint32_t lane = 0; lane < kLanes * unit.n_blocks(); ++lane) {
            const uint32_t g = layout.particle(first + lane);
            const uint32_t begin = layout.row_begin(u)[lane / kLanes], end = layout.row_begin(u)[lane / kLanes + 1];
            const uint32_t count = g == kNone ? 0 : live.count(g);
            ASSERT_LE(count, end - begin);
            for (uint32_t row = begin; row < end; ++row) {
                const uint32_t neighbour = layout.neighbours(u)[kLanes * row + lane % kLanes];
                const uint32_t k = row - begin;
                EXPECT_EQ(neighbour, k < count ? layout.lane(live.member(live.begin(g) + k)) - first : lane);
            }
            if (g == kNone) continue;
            EXPECT_TRUE(particles.insert(g).second);
            EXPECT_EQ(layout.lane(g), first + lane);
        }
    }
    EXPECT_EQ(end_block, layout.n_blocks());
    EXPECT_EQ(end_row, layout.n_rows());
    for (uint32_t g = 0; g < rest.n_particles(); ++g) {
        EXPECT_EQ(particles.contains(g), live.count(g) > 1);
        EXPECT_EQ(layout.lane(g) != kNone, live.count(g) > 1);
    }
}

TEST(lane_layout, every_membership_has_a_cell_before_and_after_breaks) {
    SimulationMesh rest = test::lattice_mesh({{5, 4, 9}, 0.1, 6, 1000, {}});
    build_one_rings(rest);
    LiveTopology live;
    live.reset(rest, std::vector<uint8_t>(rest.n_edges(), 1));
    LaneLayout layout;
    EXPECT_TRUE(layout.update(live, WorkerPool(2)));
    EXPECT_FALSE(layout.update(live, WorkerPool(2)));
    EXPECT_EQ(layout.units().size(), 1u);
    expect_whole(rest, live, layout);
    // Lanes in the order of ring sizes: hardly anything is padding.
    EXPECT_LT(layout.n_rows() * LaneLayout::kLanes, 1.15 * static_cast<double>(rest.group_member.size()));

    std::vector<EdgeId> cut;  // a slab comes off, and crumbs of it
    for (EdgeId e(0); e < rest.n_edges(); ++e) {
        const double za = rest.rest_position[rest.edges[e].a].z(), zb = rest.rest_position[rest.edges[e].b].z();
        const double middle = rest.rest_position[4 * 20].z() + 0.05;
        if ((za < middle) != (zb < middle) || (e % 3 == 0 && za > middle)) cut.push_back(e);
    }
    live.remove_edges(rest, cut);
    EXPECT_TRUE(layout.update(live, WorkerPool(2)));
    EXPECT_GT(layout.units().size(), 1u);
    expect_whole(rest, live, layout);
}

}  // namespace
}  // namespace sunder
