#include "solver/material/fracture.h"

#include <gtest/gtest.h>

#include "tests/support/loaded_lattice.h"

namespace sunder {
namespace {

using Loaded = test::LoadedLattice;

GroupStrain pulled(double load, const Vec3& normal) { return {load, 0.1 * load, normal}; }

TEST(fracture, below_the_toughness_nothing_breaks) {
    Loaded scene({{3, 3, 3}, 0.1, 6, 1000, {}});
    for (GroupStrain& s : scene.strains) s = pulled(1.0, Vec3::UnitZ());
    EXPECT_TRUE(scene.cut().empty());
}

TEST(fracture, cuts_the_edges_of_the_center_that_cross_the_plane) {
    Loaded scene({{3, 3, 3}, 0.1, 6, 1000, {}});
    scene.strains[4 + 9] = pulled(2, Vec3(0.1, 0.2, 1).normalized());  // the middle particle
    const auto cuts = scene.cut();
    // The plane runs through the centre particle, both sides weigh the same: it joins the side of the normal (up), and
    // the edges to the neighbours below go: -z, and -x and -y, which the tilted plane puts below too.
    ASSERT_EQ(cuts.size(), 3u);
    for (const BrokenEdge& c : cuts) {
        EXPECT_EQ(scene.rest.edges[c.edge].b, 13u);
        EXPECT_EQ(c.time, 0.5);
        EXPECT_DOUBLE_EQ(c.strain, 0.2);
    }
}

TEST(fracture, the_sign_of_the_normal_does_not_matter) {
    Loaded scene({{3, 3, 3}, 0.1, 26, 1000, {}});
    const Vec3 n = Vec3(0.3, -0.2, 1).normalized();
    scene.strains[13] = pulled(2, n);
    const auto cuts = scene.cut();
    scene.strains[13] = pulled(2, -n);
    EXPECT_EQ(cuts, scene.cut());
    EXPECT_FALSE(cuts.empty());
}

TEST(fracture, a_center_on_the_plane_joins_the_heavier_side) {
    Loaded scene({{3, 3, 3}, 0.1, 6, 1000, {}});
    // Drop the upper neighbour: what is below is heavier, and the remaining plane through the centre of mass lies below
    // the centre; move the particles so that the centre particle lies exactly on it.
    scene.strains[13] = pulled(2, Vec3::UnitX());
    scene.particles[12].x = scene.particles[13].x - Vec3(0.1, 0, 0);
    scene.shapes.particle_mass[12] *= 4;  // the lower (-x) neighbour made heavier
    scene.particles[14].x =
        scene.particles[13].x + 4 * Vec3(0.1, 0, 0);  // keeps the centre of mass at the centre particle
    scene.shapes.group[13].mass = 10 * scene.rest.mass[0];
    const auto cuts = scene.cut();
    ASSERT_EQ(cuts.size(), 1u);
    EXPECT_EQ(scene.rest.edges[cuts[0].edge].a, 13u);  // the edge to the light +x side
    EXPECT_EQ(scene.rest.edges[cuts[0].edge].b, 14u);
}

// Uniform over-strain: without suppression every group would cut its own plane and leave one-layer slabs.
TEST(fracture, only_the_most_loaded_group_of_a_neighbourhood_cuts) {
    Loaded scene({{4, 4, 20}, 0.05, 6, 1000, {}});
    for (size_t i = 0; i < scene.strains.size(); ++i) scene.strains[i] = pulled(2, Vec3::UnitZ());
    const auto cuts = scene.cut();
    EXPECT_GT(cuts.size(), 0u);
    EXPECT_LT(cuts.size(), 10u);
}

// A long substep takes a bar past its toughness at both ends and in the middle: what is far ahead goes first.
TEST(fracture, what_leads_in_its_piece_cuts_before_the_rest) {
    Loaded scene({{1, 1, 12}, 0.1, 6, 1000, {}});
    scene.strains[2] = pulled(1.5, Vec3::UnitZ());
    scene.strains[6] = pulled(1.3, Vec3::UnitZ());
    scene.strains[9] = pulled(1.45, Vec3::UnitZ());
    // Group g of a rod cuts edge g - 1, the one to the particle below.
    const auto edges = [&](double leading) {
        std::vector<uint32_t> cut;
        for (const BrokenEdge& c : scene.cut(leading)) cut.push_back(c.edge);
        return cut;
    };
    EXPECT_EQ(edges(0), (std::vector<uint32_t>{1, 5, 8}));
    EXPECT_EQ(edges(0.8), (std::vector<uint32_t>{1, 8}));
    scene.live.remove_edges(scene.rest, std::vector<EdgeId>{EdgeId(4)});  // two pieces, each with its own lead
    scene.shapes.reset(scene.rest, scene.live, std::vector<Mat3>(scene.rest.n_particles(), Mat3::Identity()));
    scene.strains[9] = pulled(1.2, Vec3::UnitZ());
    EXPECT_EQ(edges(0.8), (std::vector<uint32_t>{1, 5}));
}

TEST(fracture, compression_breaks_only_where_asked) {
    Material m;
    m.toughness = 0.1;
    const Vec3 squeezed(-0.5, 0.05, 0.05);
    EXPECT_LT(group_strain(squeezed, Mat3::Identity(), Quat::Identity(), m).load, 1);
    m.compressive_toughness = 0.2;
    const GroupStrain s = group_strain(squeezed, Mat3::Identity(), Quat::Identity(), m);
    EXPECT_DOUBLE_EQ(s.load, 2.5);
    EXPECT_EQ(s.normal, Vec3::UnitX());
}

}  // namespace
}  // namespace sunder
