#include "solver/lane_layout.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// Every bound particle has one lane, every membership one cell, and the neighbour there is the member's lane; what is
// left over points at itself.
void expect_whole(const SimulationMesh& rest, const LiveTopology& live, const LaneLayout& layout) {
    std::set<uint32_t> cells;
    for (uint32_t g = 0; g < rest.n_particles(); ++g) {
        const uint32_t lane = layout.lane(g);
        ASSERT_EQ(lane == LaneLayout::kNone, live.count(g) == 1);
        if (lane == LaneLayout::kNone) continue;
        EXPECT_EQ(layout.particle(lane), g);
        for (uint32_t s = live.begin(g); s < live.end(g); ++s) {
            const uint32_t cell = layout.cell(s), row = cell / LaneLayout::kLanes;
            EXPECT_TRUE(cells.insert(cell).second);
            EXPECT_EQ(cell % LaneLayout::kLanes, lane % LaneLayout::kLanes);
            EXPECT_GE(row, layout.row_begin()[lane / LaneLayout::kLanes]);
            EXPECT_LT(row, layout.row_begin()[lane / LaneLayout::kLanes + 1]);
            EXPECT_EQ(layout.neighbours()[cell], layout.lane(live.member(s)));
        }
    }
    for (uint32_t cell = 0; cell < layout.n_rows() * LaneLayout::kLanes; ++cell)
        if (!cells.contains(cell)) {
            EXPECT_EQ(layout.neighbours()[cell] % LaneLayout::kLanes, cell % LaneLayout::kLanes);
        }
    uint32_t end = 0;
    for (const LaneLayout::Unit& unit : layout.units()) {
        EXPECT_EQ(unit.begin_block, end);
        end = unit.end_block;
    }
    EXPECT_EQ(end, layout.n_blocks());
}

TEST(lane_layout, every_membership_has_a_cell_before_and_after_breaks) {
    SimulationMesh rest = test::lattice_mesh({{5, 4, 9}, 0.1, 6, 1000, {}});
    build_one_rings(rest);
    LiveTopology live;
    live.reset(rest, std::vector<uint8_t>(rest.n_edges(), 1));
    LaneLayout layout;
    EXPECT_TRUE(layout.update(live));
    EXPECT_FALSE(layout.update(live));
    EXPECT_EQ(layout.units().size(), 1u);
    expect_whole(rest, live, layout);
    // Lanes in the order of ring sizes: hardly anything is padding.
    EXPECT_LT(layout.n_rows() * LaneLayout::kLanes, 1.15 * static_cast<double>(rest.group_member.size()));

    std::vector<uint32_t> cut;  // a slab comes off, and crumbs of it
    for (uint32_t e = 0; e < rest.n_edges(); ++e) {
        const double za = rest.rest_position[rest.edges[e].a].z(), zb = rest.rest_position[rest.edges[e].b].z();
        const double middle = rest.rest_position[4 * 20].z() + 0.05;
        if ((za < middle) != (zb < middle) || (e % 3 == 0 && za > middle)) cut.push_back(e);
    }
    live.remove_edges(rest, cut);
    EXPECT_TRUE(layout.update(live));
    EXPECT_GT(layout.units().size(), 1u);
    expect_whole(rest, live, layout);
}

}  // namespace
}  // namespace sunder
