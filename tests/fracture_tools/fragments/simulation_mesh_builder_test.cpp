#include "fracture_tools/fragments/simulation_mesh_builder.h"

#include <gtest/gtest.h>

#include "fracture_tools/lattice.h"
#include "solver/data/thin_fragments.h"
#include "tests/fracture_tools/shapes.h"
#include "tests/fracture_tools/voronoi/voronoi_body.h"

namespace sunder {
namespace {

FragmentSet two_by_two() {
    LatticeSettings settings;
    settings.size = Vec3(2, 2, 1);
    settings.cells = {2, 2, 1};
    return make_lattice(settings, "lattice").take();
}

TEST(SimulationMeshBuilder, mass_is_density_times_volume) {
    SimulationMeshSettings settings;
    settings.density = 7800;
    const Result<SimulationMesh> mesh = build_simulation_mesh(two_by_two(), settings);
    ASSERT_TRUE(mesh);
    double sum = 0;
    for (double m : mesh->mass) sum += m;
    EXPECT_NEAR(sum, 7800 * 4.0, 1e-10 * 7800 * 4);
}

TEST(SimulationMeshBuilder, edges_ascend_whatever_the_order_of_interfaces) {
    FragmentSet set = two_by_two();
    std::swap(set.interfaces.front(), set.interfaces.back());
    const Result<SimulationMesh> mesh = build_simulation_mesh(set, {});
    ASSERT_TRUE(mesh);
    ASSERT_EQ(mesh->n_edges(), 4u);
    for (size_t k = 1; k < 4; ++k)
        EXPECT_LT(std::pair(mesh->edges[k - 1].a, mesh->edges[k - 1].b), std::pair(mesh->edges[k].a, mesh->edges[k].b));
    for (uint32_t i = 0; i < 4; ++i) EXPECT_EQ(mesh->group_offset[i + 1] - mesh->group_offset[i], 3u);
}

TEST(SimulationMeshBuilder, thin_pieces_keep_a_radius_that_can_be_divided_by) {
    FragmentSet set = two_by_two();
    set.fragments[2].radii = Vec3(1, 0.5, 1e-9);
    SimulationMeshSettings settings;
    settings.min_radius_share = 0.1;
    const Result<SimulationMesh> mesh = build_simulation_mesh(set, settings);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->radii[2], Vec3(1, 0.5, 0.1));
}

TEST(SimulationMeshBuilder, names_the_fragment_that_cannot_be_a_particle) {
    FragmentSet set = two_by_two();
    set.fragments[3].volume = 0;
    const Result<SimulationMesh> mesh = build_simulation_mesh(set, {});
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().where, "fragment 3");
    EXPECT_FALSE(build_simulation_mesh(FragmentSet(), {}));
    SimulationMeshSettings negative;
    negative.density = -1;
    EXPECT_FALSE(build_simulation_mesh(two_by_two(), negative));
}

TEST(SimulationMeshBuilder, refuses_a_pair_with_two_interfaces) {
    FragmentSet set = two_by_two();
    set.interfaces.push_back(set.interfaces[0]);
    const Result<SimulationMesh> mesh = build_simulation_mesh(set, {});
    ASSERT_FALSE(mesh);
    EXPECT_NE(mesh.error().what.find("two interfaces"), std::string::npos);
}

// Cells of sites anywhere have centres that tell little of where their interfaces look, and those of tets have steps.
TEST(SimulationMeshBuilder, bars_and_plates_are_slender_and_blocks_are_not_however_they_are_cut) {
    struct Case {
        Vec3 size;
        int pieces;
        double least, most;  // share that lies in a slender body
    };
    for (const Case& c : {Case{Vec3(1, 1, 1), 20, 0, 0.02}, Case{Vec3(1, 1, 1), 150, 0, 0.02},
                          Case{Vec3(1, 1, 1), 600, 0, 0.02}, Case{Vec3(1, 0.15, 0.15), 100, 0.95, 1},
                          Case{Vec3(1, 0.3, 0.1), 400, 0.95, 1}, Case{Vec3(0.6, 0.6, 0.1), 150, 0.95, 1}})
        for (const auto& [method, kind] :
             {std::pair(CutMethod::voronoi, SiteKind::uniform), std::pair(CutMethod::voronoi, SiteKind::poisson),
              std::pair(CutMethod::voronoi, SiteKind::grid), std::pair(CutMethod::kmeans, SiteKind::uniform)}) {
            PrefractureSettings settings;
            settings.method = method, settings.sites.kind = kind;
            const SimulationMesh rest = testing::VoronoiBody(testing::make_box(c.size), c.pieces, settings).rest;
            const std::vector<uint8_t> kinds = bending_groups(rest);
            const double share = static_cast<double>(std::ranges::count(kinds, kSlender)) / double(rest.n_particles());
            EXPECT_GE(share, c.least) << c.pieces << " pieces, method " << int(method) << ", sites " << int(kind);
            EXPECT_LE(share, c.most) << c.pieces << " pieces, method " << int(method) << ", sites " << int(kind);
        }
}

}  // namespace
}  // namespace sunder
