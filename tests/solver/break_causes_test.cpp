// What an edge that broke tells: at which strain of which toughness, and what pushed its piece.
#include <gtest/gtest.h>

#include "solver/step/pushers.h"
#include "tests/support/hit_scene.h"

namespace sunder {
namespace {

using test::advance, test::ball, test::Hit;

ActiveContact pressing(MovableId a, MovableId b, double impulse) {
    ActiveContact c;
    c.contact.a = a, c.contact.b = b, c.impulse.normal = impulse;
    return c;
}

// Two rows of two cells, apart from one another: edges 0 (0-1) and 1 (2-3), with a rigid body (4) and colliders.
struct Rows {
    SimulationMesh rest = test::lattice_mesh({{2, 1, 1}, 0.1, 6, 1000, {}});
    LiveTopology live;

    Rows() {
        const SimulationMesh other = rest;
        append_body(rest, other, {Vec3(0, 1, 0), Quat::Identity()});
        build_one_rings(rest);
        live.reset(rest, std::vector<uint8_t>(rest.n_edges(), 1));
    }
    std::vector<BrokenEdge> named(const std::vector<ActiveContact>& contacts) const {
        std::vector<BrokenEdge> cuts = {{EdgeId(0), 0, 0, 0, {}}, {EdgeId(1), 0, 0, 0, {}}};
        name_pushers(rest, live, contacts, cuts);
        return cuts;
    }
};

TEST(BreakCauses, the_hardest_contact_of_the_piece_is_named) {
    const Rows rows;
    const MovableId weight(4), floor(Contact::kStatic | 2u);
    const auto cuts = rows.named({pressing(MovableId(1), floor, 1), pressing(weight, MovableId(0), 3),
                                  pressing(MovableId(0), floor, 2), pressing(MovableId(2), floor, 0.5)});
    EXPECT_EQ(cuts[0].by, (Pusher{Pusher::Kind::rigid_body, 0}));
    EXPECT_EQ(cuts[1].by, (Pusher{Pusher::Kind::collider, 2}));
}

TEST(BreakCauses, pieces_push_one_another_and_none_pushes_itself) {
    const Rows rows;
    auto cuts = rows.named({pressing(MovableId(0), MovableId(1), 5), pressing(MovableId(1), MovableId(3), 1)});
    EXPECT_EQ(cuts[0].by, (Pusher{Pusher::Kind::particle, 3}));
    EXPECT_EQ(cuts[1].by, (Pusher{Pusher::Kind::particle, 1}));
    cuts = rows.named({pressing(MovableId(0), MovableId(1), 5), pressing(MovableId(2), MovableId(0), 0)});
    EXPECT_EQ(cuts[0].by, Pusher());
    EXPECT_EQ(cuts[1].by, Pusher());
}

FrameState hit_by_a_ball(int threads, std::vector<BrokenEdge>& o_broken) {
    Hit hit;
    hit.add_floor();
    const auto solver = test::make_solver(hit.scene, threads);
    FrameState state = hit.start(*solver);
    for (int f = 0; f < 3; ++f) {
        advance(*solver, hit.input(), SolverSettings(), state);
        o_broken.insert(o_broken.end(), state.broken.begin(), state.broken.end());
    }
    return state;
}

TEST(BreakCauses, a_hit_names_the_ball_and_the_toughness_that_it_exceeded) {
    std::vector<BrokenEdge> broken, by_four;
    hit_by_a_ball(1, broken), hit_by_a_ball(4, by_four);
    ASSERT_FALSE(broken.empty());
    EXPECT_EQ(broken, by_four);
    size_t by_ball = 0;
    for (const BrokenEdge& b : broken) {
        EXPECT_NEAR(b.toughness, 0.1, 1e-12);
        EXPECT_GT(b.strain, b.toughness);
        by_ball += b.by == Pusher{Pusher::Kind::rigid_body, 0};
    }
    EXPECT_EQ(broken.front().by, (Pusher{Pusher::Kind::rigid_body, 0}));
    EXPECT_GT(2 * by_ball, broken.size());
}

TEST(BreakCauses, what_pins_pull_apart_is_pushed_by_nothing) {
    for (const double energy : {kNever, 50.0}) {
        Scene scene = test::lattice_scene({{2, 2, 10}, 0.05, 6, 1000, {}});
        test::add_pin(scene, [](const Vec3& x) { return x.z() < 0.05; });
        test::add_pin(scene, [](const Vec3& x) { return x.z() > 0.45; });
        Material material;
        material.toughness = 0.05, material.fracture_energy = energy;
        const auto solver = test::make_solver(scene);
        FrameState state = solver->initial_state({material});
        FrameInput input = test::quiet_input(scene, material);
        std::vector<BrokenEdge> broken;
        for (int f = 0; f < 20; ++f) {
            input.pins[1].begin.position.z() = input.pins[1].end.position.z();
            input.pins[1].end.position.z() += 0.01;
            advance(*solver, input, SolverSettings(), state);
            broken.insert(broken.end(), state.broken.begin(), state.broken.end());
        }
        ASSERT_FALSE(broken.empty());
        EXPECT_EQ(broken.front().by, Pusher());
        for (const BrokenEdge& b : broken) EXPECT_NEAR(b.toughness, 0.05, 1e-12);
    }
}

// Of the whole scene, too, where sleepers are left out.
TEST(BreakCauses, what_pushes_is_named_as_the_whole_scene_numbers_it) {
    Hit hit;
    Scene scene;
    scene.rigid_bodies.push_back(ball(Vec3(9, 9, 0.15), 1, Vec3::Zero()));  // falls asleep on the floor
    test::LatticeBody sleeper;
    sleeper.cells = {2, 2, 2}, sleeper.pose.position = Vec3(-9, 0, 0);
    test::add_body(scene, test::lattice_mesh(sleeper), sleeper.pose);
    test::add_body(scene, hit.scene.rest);
    scene.rigid_bodies.push_back(ball(Vec3(0, 0.04, 12), 300, Vec3(0, 0, -1)));
    hit.materials.push_back(hit.materials[0]);
    hit.scene = scene;
    hit.add_floor();
    const auto solver = test::make_solver(hit.scene);
    FrameState state = hit.start(*solver);
    for (int f = 0; f < 60 && state.broken.empty(); ++f) advance(*solver, hit.input(), SolverSettings(), state);
    ASSERT_FALSE(state.broken.empty());
    EXPECT_EQ(std::ranges::count(state.asleep, 1) > 0, true) << "else this tells nothing";
    EXPECT_EQ(state.broken.front().by, (Pusher{Pusher::Kind::rigid_body, 1}));
}

}  // namespace
}  // namespace sunder
