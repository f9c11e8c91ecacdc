// Where something is hit, what does not hang together with it goes on as if nothing was (local_hit.h).
#include "solver/frame/local_hit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/hit_scene.h"

namespace sunder {
namespace {

using test::advance, test::Hit;

// Besides the block that is hit, one that spins and bends, one that lies on the floor, and loose cubes that fly, land
// and bounce. Two substeps a frame are one pair.
struct Row : Hit {
    uint32_t first_cube;

    Row() {
        add_floor();
        settings.substeps = 2;
        for (const double height : {3., 0.}) {
            test::LatticeBody block;
            block.cells = {10, 6, 4}, block.spacing = 0.1;
            test::add_body(scene, test::lattice_mesh(block), {Vec3(0, height > 0 ? 13 : 17, height), Quat::Identity()});
        }
        scene.bodies[1].angular_velocity = Vec3(4, 1, 0);
        first_cube = scene.bodies[2].particle_end;
        test::LatticeBody cube;
        cube.cells = {1, 1, 1}, cube.spacing = 0.1;
        const SimulationMesh mesh = test::lattice_mesh(cube);
        for (int k = 0; k < 200; ++k) {
            test::add_body(scene, mesh, {Vec3(0.3 * (k % 20), 20 + 0.3 * (k / 20), 0.001 * k), Quat::Identity()},
                           Vec3(0, 0, 0.02 * k));
            scene.bodies.back().angular_velocity = Vec3(0.05 * k, 1, 0);
        }
        materials.resize(scene.bodies.size(), materials[0]);
    }
};

// To the bit where it does not deform: how far equations are solved is shared out among all that deforms.
TEST(local_hit, what_is_not_hit_goes_on_as_if_nothing_was) {
    Row row;
    SolverSettings undivided = row.settings;
    undivided.hit_substeps = 1;
    const auto solver = test::make_solver(row.scene), other = test::make_solver(row.scene);
    FrameState state = row.start(*solver), same = state;
    size_t simulated = 0, parts = 0;
    double farthest = 0;
    for (int f = 0; f < 3; ++f) {
        const StepReport report = advance(*solver, row.input(), row.settings, state);
        simulated += report.simulated - advance(*other, row.input(), undivided, same).simulated;
        parts += static_cast<size_t>(report.substeps - row.settings.substeps);
        for (size_t i = row.first_cube; i < state.n_particles(); ++i) {
            ASSERT_EQ(state.position[i], same.position[i]) << "frame " << f << ", particle " << i;
            ASSERT_EQ(state.velocity[i], same.velocity[i]) << "frame " << f << ", particle " << i;
            ASSERT_EQ(state.orientation[i].coeffs(), same.orientation[i].coeffs()) << "frame " << f;
        }
        for (size_t i = row.scene.bodies[0].particle_end; i < row.first_cube; ++i)
            farthest = std::max(farthest, (state.position[i] - same.position[i]).norm());
        EXPECT_NEAR(state.time, same.time, 1e-12);
    }
    // Of blocks of a metre, one of which turns by half a radian: solved to 0.005 of all residual, a hit's among it.
    EXPECT_LT(farthest, 0.002);
    EXPECT_GT(test::count_broken(state), 2 * test::count_broken(same));
    EXPECT_GT(parts, 20u);
    EXPECT_LT(simulated, 600 * parts);  // a block and its weight in two passes; all of the scene would be 921 in each
}

TEST(local_hit, what_is_hit_goes_on_as_if_it_was_alone) {
    Row row;
    row.settings.substeps = 1;
    Hit lone;
    lone.add_floor();
    const auto solver = test::make_solver(row.scene), other = test::make_solver(lone.scene);
    FrameState state = row.start(*solver), same = lone.start(*other);
    EXPECT_GT(advance(*solver, row.input(), row.settings, state).substeps, 1);
    advance(*other, lone.input(), row.settings, same);
    // Margins of contacts, a share of the mean size of all that there is, are rounded otherwise.
    for (size_t i = 0; i < same.n_particles(); ++i)
        EXPECT_LT((state.position[i] - same.position[i]).norm(), 1e-9) << "particle " << i;
    EXPECT_EQ(test::count_broken(state), test::count_broken(same));
    EXPECT_GT(test::count_broken(same), 40u);
}

// Part of it is held until something breaks beside it, and part is glued so long: that lets go between parts of a hit,
// whoever takes them.
TEST(local_hit, what_breaks_lets_go_between_parts_as_if_it_was_alone) {
    Row row;
    row.settings.substeps = 1;
    Hit lone;
    lone.add_floor();
    for (Scene* scene : {&row.scene, &lone.scene})
        for (const Keeps keeps : {Keeps::held, Keeps::glued}) {
            Activation a;
            a.name = "keep", a.keeps = keeps, a.until = Until::neighbour;
            for (ParticleId i(0); i < lone.scene.rest.n_particles(); ++i)
                if (const double x = lone.scene.rest.rest_position[i].x(); keeps == Keeps::held ? x < -0.1 : x > 0.1)
                    a.particles.push_back(i);
            scene->activations.push_back(a);
        }
    FrameInput of_row = row.input(), of_lone = lone.input();
    of_row.activations.resize(row.scene.activations.size()), of_lone.activations.resize(row.scene.activations.size());
    const auto solver = test::make_solver(row.scene), other = test::make_solver(lone.scene);
    FrameState state = row.start(*solver), same = lone.start(*other);
    EXPECT_GT(advance(*solver, of_row, row.settings, state).substeps, 1);
    advance(*other, of_lone, row.settings, same);
    size_t let_go = 0;
    for (size_t i = 0; i < same.n_particles(); ++i) {
        EXPECT_LT((state.position[i] - same.position[i]).norm(), 1e-9) << "particle " << i;
        EXPECT_EQ(state.inactive[i].what, same.inactive[i].what) << "particle " << i;
        let_go += same.inactive[i].what == 0;
    }
    EXPECT_EQ(test::count_broken(state), test::count_broken(same));
    EXPECT_GT(let_go, 60u);
}

TEST(local_hit, gives_the_same_bits_on_any_number_of_threads_and_from_any_frame) {
    Row row;
    std::vector<uint64_t> hashes;
    FrameState middle;
    for (const int threads : {1, 2, 4}) {
        const auto solver = test::make_solver(row.scene, threads);
        FrameState state = row.start(*solver);
        for (int f = 0; f < 6; ++f) {
            if (f == 2) middle = state;
            advance(*solver, row.input(), row.settings, state);
        }
        hashes.push_back(state_hash(state));
    }
    EXPECT_GT(test::count_broken(middle), 10u);
    const auto solver = test::make_solver(row.scene, 2);
    for (int f = 2; f < 6; ++f) advance(*solver, row.input(), row.settings, middle);
    hashes.push_back(state_hash(middle));
    for (const uint64_t hash : hashes) EXPECT_EQ(hash, hashes[0]);
}

// What sleeps beside a hit costs nothing and sleeps on; what does not sleep is there, too.
TEST(local_hit, sleepers_sleep_on) {
    Row row;
    row.gravity = 0, row.scene.colliders.clear();
    for (Body& body : row.scene.bodies) body.angular_velocity = Vec3::Zero();
    for (size_t k = 3; k < row.scene.bodies.size(); ++k)
        row.scene.bodies[k].velocity = k < 13 ? Vec3(0, 0, 0) : Vec3(0, 0, 0.5);
    row.scene.bodies[1].velocity = Vec3(0, 0, 0.5);
    row.scene.rigid_bodies[0].pose.position.z() += 6;  // it comes down after a second
    const auto solver = test::make_solver(row.scene);
    FrameState state = row.start(*solver);
    int most = 0;
    for (int f = 0; f < 30; ++f) most = std::max(most, advance(*solver, row.input(), row.settings, state).substeps);
    EXPECT_GT(test::count_broken(state), 50u);
    EXPECT_GT(most, 10);
    const SimulationMesh& rest = solver->scene().rest;
    for (size_t k : {1u, 2u, 3u, 12u, 13u, 202u}) {
        const double way = k == 2 || (k > 2 && k < 13) ? 0 : 0.5 * 30 / 24;
        for (uint32_t i = row.scene.bodies[k].particle_begin; i < row.scene.bodies[k].particle_end; ++i) {
            EXPECT_EQ(state.asleep[i], way == 0) << "body " << k << ", particle " << i;
            EXPECT_NEAR(state.position[i].z() - rest.rest_position[i].z(), way, 1e-9) << "body " << k;
        }
    }
}

// The block that is hit and another, as LocalHit and substeps see them.
struct Two : Hit {
    WorkerPool workers{1};

    explicit Two(double y) {
        test::LatticeBody block;
        block.cells = {10, 6, 4}, block.spacing = 0.1;
        test::add_body(scene, test::lattice_mesh(block), {Vec3(0, y, 0), Quat::Identity()});
        materials.resize(2, materials[0]);
    }
};

// A block far from the hit whose halves move apart at a thirteenth, or a seventh, of the speed that would break it.
TEST(local_hit, what_rings_takes_the_parts_too) {
    Two hit(20);
    const auto solver = test::make_solver(hit.scene);
    const FrameInput input = hit.input();
    const StepContext context{solver->scene(), input, hit.settings, hit.workers, 1e-3};
    const double wave_speed = std::sqrt(hit.materials[0].youngs_modulus / 1000);  // density
    for (const double share : {1. / 13, 1. / 7}) {
        FrameState state = hit.start(*solver);
        const uint32_t first = hit.scene.bodies[1].particle_begin;
        for (uint32_t i = first; i < state.n_particles(); ++i)
            state.velocity[i].x() =
                std::copysign(share * wave_speed * hit.materials[0].toughness, state.position[i].x());
        StepMemory memory;
        StepReport report;
        memory.synchronise(context, state);
        const auto outcome = step(context, {Stage::alone, input.duration / 4, 0, 1, false}, memory, state, report);
        ASSERT_TRUE(outcome);
        ASSERT_GT(outcome->hit.parts, 1);
        EXPECT_TRUE(outcome->hit.what[0]);
        EXPECT_EQ(outcome->hit.what[first], share > 0.1) << share;
    }
}

// A weight that flies against a block, 10 cm from another: told that only these two are hit, nothing is done as soon as
// they meet the third.
TEST(local_hit, gives_up_where_what_is_hit_meets_the_rest) {
    Two hit(0.7);
    hit.gravity = 0;
    hit.scene.rigid_bodies[0] = test::ball(Vec3(0, -0.48, 0.2), 300, Vec3(0, 20, 0));
    const auto solver = test::make_solver(hit.scene);
    const FrameInput input = hit.input();
    const StepContext context{solver->scene(), input, hit.settings, hit.workers, 1e-3};
    FrameState state = hit.start(*solver);
    const FrameState before = state;
    std::vector<uint8_t> what(state.n_particles() + 1, 0);
    std::fill(what.begin(), what.begin() + hit.scene.bodies[0].particle_end, uint8_t{1});
    what.back() = 1;
    LocalHit local;
    StepPair pair;
    StepReport report;
    const auto advance_for = [&](double seconds) {
        return local.advance(context, what, 16, {Stage::alone, seconds, 0, 1, true}, Progress(), state, pair, report);
    };
    const auto met = advance_for(input.duration);
    ASSERT_TRUE(met) << met.error().text();
    EXPECT_FALSE(*met);
    EXPECT_TRUE(state == before);
    EXPECT_EQ(report.edges_broken, 0u);
    const auto shorter = advance_for(input.duration / 8);
    ASSERT_TRUE(shorter) << shorter.error().text();
    EXPECT_TRUE(*shorter);
    EXPECT_GT(report.edges_broken, 0u);
    EXPECT_EQ(report.edges_broken, test::count_broken(state));
}

}  // namespace
}  // namespace sunder
