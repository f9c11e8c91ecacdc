#include "fracture_tools/skin/skin_candidates.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "fracture_tools/fragments/simulation_mesh_builder.h"
#include "fracture_tools/lattice.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/voronoi/voronoi_body.h"

namespace sunder {
namespace {

constexpr int kLength = 9, kWidth = 4;

// A plate of fragments, by their places in it.
struct Plate {
    SimulationMesh rest = [] {
        const LatticeSettings settings{.size = Vec3(kLength, kWidth, 0.3), .cells = {kLength, kWidth, 1}};
        return build_simulation_mesh(make_lattice(settings, "plate").take(), {}).take();
    }();
    std::vector<uint8_t> intact = std::vector<uint8_t>(rest.n_edges(), 1);

    static uint32_t at(int x, int y) { return uint32_t(y * kLength + x); }
    void cut(uint32_t a, uint32_t b) {
        for (size_t e = 0; e < rest.n_edges(); ++e)
            if (rest.edges[e].a == a && rest.edges[e].b == b) intact[e] = 0;
    }
};

bool has(std::span<const uint32_t> ring, uint32_t particle) { return std::ranges::binary_search(ring, particle); }

TEST(IntactRings, of_a_plate_hold_neighbours_of_neighbours_but_none_across_a_crack) {
    Plate plate;
    IntactRings rings(plate.rest);
    rings.update(plate.intact);
    const uint32_t of = plate.at(4, 0), ahead = plate.at(5, 0), diagonal = plate.at(5, 1), beyond = plate.at(6, 0),
                   aside = plate.at(4, 1), far = plate.at(7, 0);
    for (const uint32_t j : {of, ahead, diagonal, beyond, aside}) EXPECT_TRUE(has(rings[of], j)) << j;
    EXPECT_FALSE(has(rings[of], far));

    plate.cut(of, ahead);
    rings.update(plate.intact);
    EXPECT_TRUE(rings.changed()[of] && rings.changed()[ahead] && rings.changed()[plate.at(3, 0)]);
    EXPECT_FALSE(rings.changed()[plate.at(8, 3)]);
    for (const uint32_t j : {ahead, diagonal, beyond}) {  // all, or one, of the ways to them led there
        EXPECT_FALSE(has(rings[of], j)) << j;
        EXPECT_FALSE(has(rings[j], of)) << j;
    }
    EXPECT_TRUE(has(rings[of], aside));

    std::ranges::fill(plate.intact, 1);
    rings.update(plate.intact);
    EXPECT_TRUE(has(rings[of], diagonal));
}

TEST(IntactRings, of_blocks_hold_neighbours_alone) {
    const testing::VoronoiBody block(testing::make_box(), 60);
    IntactRings rings(block.rest);
    rings.update(block.intact);
    for (uint32_t i = 0; i < block.rest.n_particles(); ++i) {
        const uint32_t begin = block.rest.group_offset[i], end = block.rest.group_offset[i + 1];
        ASSERT_EQ(rings[i].size(), end - begin);
        for (uint32_t s = begin; s < end; ++s) EXPECT_EQ(rings[i][s - begin], block.rest.group_member[s]);
    }
}

TEST(IntactRings, of_a_fragment_that_is_alone_hold_itself) {
    const testing::VoronoiBody block(testing::make_box(), 1);
    IntactRings rings(block.rest);
    rings.update(block.intact);
    ASSERT_EQ(rings[0].size(), 1u);
    EXPECT_EQ(rings[0][0], 0u);
    EXPECT_TRUE(rings.changed()[0]);
}

}  // namespace
}  // namespace sunder
