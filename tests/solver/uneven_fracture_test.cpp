// Bodies that are not equally tough everywhere: weak and glued interfaces, tough fragments.
#include <gtest/gtest.h>

#include "tests/support/loaded_lattice.h"

namespace sunder {
namespace {

// The middle group of 3x3x3 cells, its edges made weak or strong, pulled by strain 0.1 along chosen axes at toughness
// 0.1.
struct Uneven : test::LoadedLattice {
    static constexpr uint32_t kMiddle = 13;

    Uneven() : LoadedLattice({{3, 3, 3}, 0.1, 6, 1000, {}}) {}
    void set_factor(uint32_t neighbour, double factor) {
        for (Edge& e : rest.edges)
            if (std::minmax(e.a.value, e.b.value) == std::minmax(kMiddle, neighbour)) e.toughness_factor = factor;
        build_one_rings(rest);
    }
    void pull(const Vec3& strain) {
        Material m;
        m.toughness = 0.1;
        strains[kMiddle] = uneven_group_strain(strain, Mat3::Identity(), Quat::Identity(), m,
                                               {rest, live, shapes, particles}, kMiddle);
    }
    std::vector<uint32_t> parted() const {
        std::vector<uint32_t> neighbours;
        for (const BrokenEdge& c : cut())
            neighbours.push_back(rest.edges[c.edge].a == kMiddle ? rest.edges[c.edge].b : rest.edges[c.edge].a);
        return neighbours;
    }
};

TEST(UnevenFracture, the_plane_moves_to_the_weaker_side) {
    Uneven scene;
    scene.pull(Vec3(0, 0, 0.1001));
    EXPECT_EQ(scene.parted(), std::vector<uint32_t>{22});  // above: the rule for a centre on the plane
    scene.set_factor(4, 0.25);                             // below
    scene.pull(Vec3(0, 0, 0.024));
    EXPECT_TRUE(scene.parted().empty());
    scene.pull(Vec3(0, 0, 0.026));
    EXPECT_EQ(scene.parted(), std::vector<uint32_t>{4});
}

TEST(UnevenFracture, tough_edges_hold_until_their_own_limit) {
    Uneven scene;
    scene.set_factor(4, 3), scene.set_factor(22, 3);
    scene.pull(Vec3(0, 0, 0.29));
    EXPECT_TRUE(scene.parted().empty());
    scene.pull(Vec3(0, 0, 0.31));
    EXPECT_EQ(scene.parted(), std::vector<uint32_t>{22});
}

TEST(UnevenFracture, glued_edges_never_break_and_others_break_across_a_smaller_strain) {
    Uneven scene;
    scene.set_factor(4, kNever), scene.set_factor(22, kNever);
    scene.pull(Vec3(0, 0, 5));
    EXPECT_EQ(scene.strains[Uneven::kMiddle].load, 0);
    EXPECT_TRUE(scene.parted().empty());
    scene.pull(Vec3(0.11, 0, 5));
    EXPECT_DOUBLE_EQ(scene.strains[Uneven::kMiddle].load, 1.1);
    EXPECT_EQ(scene.parted(), std::vector<uint32_t>{12});  // -x
    for (uint32_t j : {10u, 12u, 14u, 16u}) scene.set_factor(j, kNever);
    scene.pull(Vec3(5, 5, 5));
    EXPECT_TRUE(scene.parted().empty());
}

// A weak edge that a pull runs along must not open, though its far end lies a little beyond the plane.
TEST(UnevenFracture, a_weak_edge_along_the_plane_counts_little) {
    Uneven scene;
    scene.set_factor(12, 0.1);
    scene.particles[12].x.z() -= 0.01;
    scene.pull(Vec3(0, 0, 0.05));
    EXPECT_TRUE(scene.parted().empty());
    EXPECT_LT(scene.strains[Uneven::kMiddle].load, 0.6);
}

TEST(UnevenFracture, of_a_cross_section_only_what_is_strained_enough_goes) {
    Uneven scene;
    scene.set_factor(4, 0.2), scene.set_factor(12, 0.9);
    scene.particles[12].x.z() -= 0.05;  // both lie beyond the plane, at 90 and 27 degrees
    scene.pull(Vec3(0, 0, 0.05));
    EXPECT_EQ(scene.parted(), std::vector<uint32_t>{4});
}

// A bar of three layers pulled apart at both ends.
struct PulledStrip {
    Scene scene = test::lattice_scene({{3, 3, 12}, 0.05, 6, 1000, {}});
    Material material;
    PulledStrip() {
        test::add_pin(scene, [](const Vec3& x) { return x.z() < 0.05; });
        test::add_pin(scene, [](const Vec3& x) { return x.z() > 0.55; });
        material.youngs_modulus = 2e5;
        material.toughness = 0.1;
    }
    static double height(const Scene& scene, const Edge& e) {
        return 0.5 * (scene.rest.rest_position[e.a].z() + scene.rest.rest_position[e.b].z());
    }
    FrameState run(int frames, double speed) const {
        const auto solver = test::make_solver(scene);
        FrameState state = solver->initial_state({material});
        for (int f = 0; f < frames; ++f) {
            FrameInput in = test::quiet_input(scene, material);
            in.pins[1].begin.position.z() = speed * f / 24;
            in.pins[1].end.position.z() = speed * (f + 1) / 24;
            test::advance(*solver, in, {}, state);
        }
        return state;
    }
};

TEST(UnevenFracture, a_pulled_strip_tears_at_its_weak_interfaces) {
    PulledStrip strip;
    for (Edge& e : strip.scene.rest.edges)
        if (std::abs(PulledStrip::height(strip.scene, e) - 0.4) < 1e-6) e.toughness_factor = 0.3;
    const FrameState state = strip.run(12, 0.1);
    EXPECT_EQ(test::count_broken(state), 9u);
    for (size_t e = 0; e < state.edge_intact.size(); ++e)
        if (!state.edge_intact[e]) {
            EXPECT_EQ(strip.scene.rest.edges[e].toughness_factor, 0.3) << "edge " << e;
        }
}

TEST(UnevenFracture, a_pulled_strip_tears_in_its_weak_band) {
    PulledStrip strip;
    strip.scene.rest.toughness_factor.assign(strip.scene.rest.n_particles(), 1.0);
    for (size_t i = 0; i < strip.scene.rest.n_particles(); ++i)
        if (std::abs(strip.scene.rest.rest_position[i].z() - 0.2) < 0.03) strip.scene.rest.toughness_factor[i] = 0.3;
    const FrameState state = strip.run(12, 0.1);
    EXPECT_EQ(test::count_pieces(strip.scene.rest, state), 2u);
    for (size_t e = 0; e < state.edge_intact.size(); ++e)
        if (!state.edge_intact[e]) {
            EXPECT_LT(std::abs(PulledStrip::height(strip.scene, strip.scene.rest.edges[e]) - 0.2), 0.06)
                << "edge " << e;
        }
}

TEST(UnevenFracture, a_glued_strip_holds_whatever_pulls) {
    PulledStrip strip;
    for (Edge& e : strip.scene.rest.edges) e.toughness_factor = kNever;
    EXPECT_EQ(test::count_broken(strip.run(24, 0.5)), 0u);
}

TEST(UnevenFracture, factors_of_one_change_no_bit) {
    PulledStrip plain, factored;
    const FrameState state = plain.run(16, 0.3);
    EXPECT_GT(test::count_broken(state), 0u);
    factored.scene.rest.toughness_factor.assign(factored.scene.rest.n_particles(), 1.0);
    factored.scene.rest.yield_factor.assign(factored.scene.rest.n_particles(), 1.0);
    EXPECT_EQ(state_hash(factored.run(16, 0.3)), state_hash(state));
}

TEST(UnevenFracture, bodies_with_and_without_factors_share_a_scene) {
    const SimulationMesh plain = test::lattice_mesh({{2, 1, 1}, 0.1, 6, 1000, {}});
    SimulationMesh factored = plain;
    factored.toughness_factor = {2, 3};
    factored.edges[0].toughness_factor = 0.5;
    SimulationMesh scene;
    for (const SimulationMesh* body : {&plain, &std::as_const(factored), &plain}) append_body(scene, *body, Pose{});
    build_one_rings(scene);
    EXPECT_EQ(scene.toughness_factor, (std::vector<double>{1, 1, 2, 3, 1, 1}));
    EXPECT_TRUE(scene.yield_factor.empty());
    EXPECT_EQ(scene.group_uneven, (std::vector<uint8_t>{0, 0, 1, 1, 0, 0}));
}

}  // namespace
}  // namespace sunder
