#include "solver/sleep/sleeping.h"

#include <gtest/gtest.h>

#include <random>

#include "solver/collision/movable_size.h"
#include "solver/scene/motion.h"
#include "solver/scene/scales.h"
#include "solver/step/step.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

using test::advance;

constexpr double kSpacing = 0.1;  // m, of all lattices here

// Bodies on a floor.
struct Ground {
    Scene scene;
    FrameInput input;
    SolverSettings settings;

    Ground() {
        scene.colliders.push_back({"floor", {ShapeKind::plane}, 0.6, 0.0});
        input.colliders.resize(1);
    }
    // `cells` across each side; loose: without edges.
    void add(int cells, const Vec3& place, bool loose = false, const Vec3& velocity = Vec3::Zero()) {
        SimulationMesh mesh = test::lattice_mesh({{cells, cells, cells}, kSpacing, 6, 1000, {}});
        if (loose) mesh.edges.clear();
        test::add_body(scene, mesh, {place, Quat::Identity()}, velocity);
        input.materials.push_back({});
    }
    void add_sphere(const Vec3& place, const Vec3& velocity) {
        RigidBody ball;
        ball.name = "ball", ball.shape.radius = 0.1, ball.mass = 4;
        ball.pose.position = place, ball.velocity = velocity;
        scene.rigid_bodies.push_back(ball);
    }
    void add_collider(const Vec3& place) {
        Collider box{"box", {ShapeKind::box}};
        box.shape.half_extents.setConstant(0.1);
        scene.colliders.push_back(box);
        input.colliders.emplace_back();
        input.colliders.back().begin.position = input.colliders.back().end.position = place;
    }
};

// How many of a body's particles sleep.
size_t asleep(const Ground& g, const FrameState& s, size_t body) {
    const Body& b = g.scene.bodies[body];
    return static_cast<size_t>(std::count(s.asleep.begin() + b.particle_begin, s.asleep.begin() + b.particle_end, 1));
}

StepReport run(Solver& solver, const Ground& g, FrameState& io_state, int frames) {
    StepReport last;
    for (int f = 0; f < frames; ++f) last = advance(solver, g.input, g.settings, io_state);
    return last;
}

// A soft body and loose fragments that lie still, apart from one another.
struct Resting : Ground {
    std::unique_ptr<Solver> solver;
    FrameState state;

    explicit Resting(bool with_ball = false) {
        add(3, Vec3(-1, 0, 0)), add(2, Vec3(1, 0, 0), true);
        if (with_ball) add_sphere(Vec3(-1, 0, 14), Vec3::Zero());  // arrives after 40 frames
        start();
    }
    void start() {
        solver = test::make_solver(scene);
        state = solver->initial_state(input.materials);
    }
    void settle() {
        run(*solver, *this, state, 36);
        ASSERT_EQ(asleep(*this, state, 0), 27u);
        ASSERT_EQ(asleep(*this, state, 1), 8u);
    }
};

TEST(sleeping, what_rests_costs_nothing_and_does_not_move_by_a_bit) {
    Resting r;
    r.settle();
    const FrameState before = r.state;
    const StepReport report = run(*r.solver, r, r.state, 10);
    EXPECT_EQ(report.simulated, 0u);
    EXPECT_EQ(report.asleep, 35u);
    EXPECT_EQ(report.n_components, 9u);
    EXPECT_EQ(r.state.position, before.position);
    EXPECT_NEAR(r.state.time, before.time + 10.0 / 24, 1e-12);
    for (const Vec3& v : r.state.velocity) EXPECT_EQ(v, Vec3(Vec3::Zero()));
}

TEST(sleeping, off_simulates_everything) {
    Resting r;
    r.settings.sleeping = false;
    const StepReport report = run(*r.solver, r, r.state, 36);
    EXPECT_EQ(report.asleep, 0u);
    EXPECT_EQ(report.simulated, 35u * 8u);
    EXPECT_TRUE(r.state.asleep.empty());
}

TEST(sleeping, an_impact_wakes_the_island_and_no_other) {
    Resting r(true);
    r.settle();
    ASSERT_GT(r.state.rigid_bodies[0].position.z(), 0.4);  // a rigid body in free fall does not sleep
    for (int f = 0; f < 8 && asleep(r, r.state, 0) > 0; ++f) run(*r.solver, r, r.state, 1);
    EXPECT_EQ(asleep(r, r.state, 0), 0u);
    EXPECT_EQ(asleep(r, r.state, 1), 8u);
}

TEST(sleeping, an_impact_is_felt_as_if_nothing_had_slept) {
    std::vector<Vec3> end[2];
    for (const bool sleeping : {false, true}) {
        Resting r(true);
        r.settings.sleeping = sleeping;
        run(*r.solver, r, r.state, 60);
        end[sleeping] = r.state.position;
    }
    double apart = 0;
    for (size_t i = 0; i < 27; ++i) apart = std::max(apart, (end[0][i] - end[1][i]).norm());
    EXPECT_LT(apart, 0.01 * kSpacing);
}

TEST(sleeping, gravity_wakes_all_and_a_material_its_body) {
    Resting r;
    r.settle();
    const FrameState resting = r.state;
    r.input.materials[1].friction = 0.1;
    run(*r.solver, r, r.state, 1);
    EXPECT_EQ(asleep(r, r.state, 0), 27u);
    EXPECT_EQ(asleep(r, r.state, 1), 0u);
    r.state = resting;
    r.input.materials[1].friction = Material().friction;
    r.input.gravity = Vec3(0, 3, -9);
    run(*r.solver, r, r.state, 1);
    EXPECT_EQ(std::count(r.state.asleep.begin(), r.state.asleep.end(), 1), 0);
}

TEST(sleeping, a_collider_that_moves_wakes_what_is_near_it) {
    Resting r;
    r.add_collider(Vec3(1, 0, 1));
    r.start();
    r.settle();
    r.input.colliders[1].end.position.z() = 0.8;  // far above the loose fragments still
    run(*r.solver, r, r.state, 1);
    EXPECT_EQ(asleep(r, r.state, 1), 8u);
    r.input.colliders[1].begin.position.z() = 0.8, r.input.colliders[1].end.position.z() = 0.25;
    run(*r.solver, r, r.state, 1);
    EXPECT_EQ(asleep(r, r.state, 0), 27u);
    EXPECT_EQ(asleep(r, r.state, 1), 0u);
}

TEST(sleeping, a_floor_that_goes_lets_everything_fall) {
    Resting r;
    r.settle();
    const double z = r.state.position[0].z();
    r.input.colliders[0].active = false;
    run(*r.solver, r, r.state, 12);
    EXPECT_NEAR(z - r.state.position[0].z(), 0.5 * 9.81 * 0.25, 0.06);
}

TEST(sleeping, a_pin_that_moves_or_lets_go_wakes_what_it_holds) {
    for (const bool lets_go : {false, true}) {
        Ground g;
        g.add(3, Vec3(0, 0, 0.5));
        test::add_pin(g.scene, [](const Vec3& x) { return x.x() < -0.05; });
        g.input.pins.resize(1);
        const auto solver = test::make_solver(g.scene);
        FrameState state = solver->initial_state(g.input.materials);
        g.settings.damping = 5;
        run(*solver, g, state, 72);
        ASSERT_EQ(asleep(g, state, 0), 27u);
        if (lets_go)
            g.input.pins[0].active = false;
        else
            g.input.pins[0].end.position.x() = 0.05;
        run(*solver, g, state, 1);
        EXPECT_EQ(asleep(g, state, 0), 0u);
    }
}

TEST(sleeping, a_state_set_from_outside_is_awake) {
    Resting r;
    r.settle();
    r.state.position[30].z() += 0.05;
    run(*r.solver, r, r.state, 1);
    EXPECT_EQ(std::count(r.state.asleep.begin(), r.state.asleep.end(), 1), 0);
}

TEST(sleeping, slow_drift_without_gravity_goes_on) {
    Ground g;
    g.input.gravity.setZero();
    g.add(2, Vec3(0, 0, 0.5), false, Vec3(1e-4, 0, 0));
    const auto solver = test::make_solver(g.scene);
    FrameState state = solver->initial_state(g.input.materials);
    const double x = state.position[0].x();
    run(*solver, g, state, 48);
    EXPECT_NEAR(state.position[0].x() - x, 2e-4, 1e-9);
}

// At a speed at which a stone that creeps falls asleep, what flows goes on flowing.
TEST(sleeping, what_flows_slowly_goes_on) {
    Ground g;
    g.add(1, Vec3(0, 0, 0));
    const auto solver = test::make_solver(g.scene);
    g.input.gravity = Vec3(0, 0, -9.81);
    const double speed = 0.003 * std::sqrt(9.81 * size_of(solver->scene(), 0));
    EXPECT_GT(speed, still_speed(size_of(solver->scene(), 0), 9.81, true));
    EXPECT_LT(speed, still_speed(size_of(solver->scene(), 0), 9.81, false));
    for (const bool flows : {false, true}) {
        FrameState state = solver->initial_state(g.input.materials);
        for (int f = 0; f < 48; ++f) {
            const FrameState before = state;
            state.position[0].x() += speed * g.input.duration;
            state.time += g.input.duration;
            if (flows) state.plastic_deformation[0](0, 0) *= 1 + 1e-6;
            fall_asleep(solver->scene(), g.input, true, before, state);
        }
        EXPECT_EQ(state.asleep[0], flows ? 0 : 1);
    }
}

// Of the loose fragments of Resting, one that lies on another.
uint32_t upper_one(const Resting& r) {
    uint32_t upper = r.scene.bodies[1].particle_begin;
    for (uint32_t i = upper; i < r.scene.bodies[1].particle_end; ++i)
        if (r.state.position[i].z() > r.state.position[upper].z()) upper = i;
    return upper;
}

TEST(sleeping, what_nothing_carries_any_more_wakes_and_nothing_else) {
    Resting r;
    r.settle();
    const uint32_t upper = upper_one(r);
    ASSERT_GT(r.state.position[upper].z(), 0.1);
    const auto erased =
        std::erase_if(r.state.contacts, [&](const ContactMemory& c) { return c.a == upper || c.b == upper; });
    ASSERT_GT(erased, 0u);
    const Vec3 before = r.state.position[upper];
    run(*r.solver, r, r.state, 1);
    EXPECT_EQ(r.state.asleep[upper], 0);
    EXPECT_EQ(std::ranges::count(r.state.asleep, 1), 34);
    run(*r.solver, r, r.state, 12);  // what it lay on was there after all
    EXPECT_EQ(std::ranges::count(r.state.asleep, 1), 35);
    EXPECT_LT((r.state.position[upper] - before).norm(), 0.002 * kSpacing);
}

TEST(sleeping, what_is_pressed_otherwise_wakes_at_the_next_look) {
    for (const double change : {0.9 * kWakingChange, 1.1 * kWakingChange}) {
        Resting r;
        r.settle();
        const uint32_t upper = upper_one(r);
        r.state.rest_load[upper] /= 1 - change;
        for (int f = 0; f < 5; ++f) {
            EXPECT_EQ(run(*r.solver, r, r.state, 1).asleep, 35u);
        }
        run(*r.solver, r, r.state, 1);
        EXPECT_EQ(r.state.asleep[upper], change < kWakingChange ? 1 : 0);
        EXPECT_EQ(std::ranges::count(r.state.asleep, 1), change < kWakingChange ? 35 : 34);
        run(*r.solver, r, r.state, 6);
        EXPECT_EQ(std::ranges::count(r.state.asleep, 1), 35);
    }
}

TEST(sleeping, a_touch_wakes_what_it_touches_and_a_hit_what_it_is_passed_on_to) {
    Resting r(true);
    r.settle();
    const uint32_t upper = upper_one(r);
    const double hard = hard_speed(size_of(r.solver->scene(), upper), 9.81);
    struct Case {
        Vec3 velocity;
        size_t asleep;  // of the eight
    };
    for (const Case& ball :
         {Case{Vec3(0, 0, -0.6 * hard), 7}, {Vec3(0, 0, -5 * hard), 6}, {Vec3(1.2 * hard, 0, 0), 7}}) {
        FrameState state = r.state;
        state.rigid_bodies[0].position = state.position[upper] + Vec3(0, 0, 0.1 + r.scene.rest.radii[upper].z() + 1e-4);
        state.rigid_bodies[0].velocity = ball.velocity;
        run(*r.solver, r, state, 1);
        EXPECT_EQ(state.asleep[upper], 0);
        EXPECT_EQ(asleep(r, state, 1), ball.asleep);
        EXPECT_EQ(asleep(r, state, 0), 27u);
    }
}

// Heaps that fall together, and go to sleep piece by piece while others still move.
struct Heap : Ground {
    Heap() {
        std::mt19937_64 rng(3);
        std::uniform_real_distribution<double> uniform(-1, 1);
        const SimulationMesh one = test::lattice_mesh({{1, 1, 1}, kSpacing, 6, 1000, {}});
        for (int k = 0; k < 40; ++k) {
            const Vec3 place(0.13 * (k % 3), 0.13 * (k / 3 % 3), 0.13 * (k / 9));
            test::add_body(scene, one, {place, rotation_of(Vec3(uniform(rng), uniform(rng), uniform(rng)))});
            input.materials.push_back({});
        }
        add(2, Vec3(1, 0, 0.02)), add(2, Vec3(1, 0, 0.25));
        add_sphere(Vec3(0.13, 0.13, 10), Vec3::Zero());  // lands on the heap after 33 frames
    }
};

// Sleepers beside what is awake: rotations that went through those since rest and back were rounded in each substep.
TEST(sleeping, what_is_fixed_keeps_its_bits) {
    Heap heap;
    const auto solver = test::make_solver(heap.scene);
    FrameState state = solver->initial_state(heap.input.materials);
    std::mt19937_64 rng(5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (Quat& q : state.orientation) q = rotation_of(Vec3(uniform(rng), uniform(rng), uniform(rng))) * q;
    const FrameState before = state;
    std::vector<uint8_t> fixed(state.n_particles() + state.rigid_bodies.size(), 0);
    for (size_t i = 0; i < fixed.size(); ++i) fixed[i] = i % 5 != 0;
    const WorkerPool workers(1);
    const StepContext context{solver->scene(), heap.input, heap.settings, workers, 1e-3, fixed, false};
    StepMemory memory;
    StepReport report;
    memory.synchronise(context, state);
    for (int k = 0; k < 4; ++k) ASSERT_TRUE(step(context, {Stage::alone, 0.005, 0, 1, false}, memory, state, report));
    for (size_t i = 0; i < state.n_particles(); ++i) {
        if (!fixed[i]) continue;
        EXPECT_EQ(before.position[i], state.position[i]) << "particle " << i;
        EXPECT_EQ(before.orientation[i].coeffs(), state.orientation[i].coeffs()) << "particle " << i;
    }
    EXPECT_NE(before.position[0], state.position[0]);
    // Woken in the middle of a pair, it has no first half to go on from.
    ASSERT_TRUE(step(context, {Stage::first, 0.005, 0, 1, false}, memory, state, report));
    for (size_t i = 0; i < fixed.size(); ++i) EXPECT_FALSE(fixed[i] && memory.pair.smooth[i]) << i;
}

TEST(sleeping, going_on_from_any_frame_gives_the_same_bits_for_any_number_of_threads) {
    const Heap heap;
    const auto solver = test::make_solver(heap.scene);
    std::vector<FrameState> states = {solver->initial_state(heap.input.materials)};
    size_t most = 0, least_after = 1000, n_beside_awake = 0;
    for (int f = 0; f < 40; ++f) {
        states.push_back(states.back());
        const size_t n = advance(*solver, heap.input, heap.settings, states.back()).asleep;
        most = std::max(most, n);
        if (n < most) least_after = std::min(least_after, n);
        const FrameState& now = states.back();
        for (const ContactMemory& c : now.contacts)
            n_beside_awake += c.b < now.asleep.size() && now.asleep[c.a] != now.asleep[c.b];
    }
    EXPECT_GT(most, 8u);
    EXPECT_LT(least_after, most);    // some were woken
    EXPECT_GT(n_beside_awake, 20u);  // and slept beside what moves
    for (const int from : {13, 20, 25, 30}) {
        const auto fresh = test::make_solver(heap.scene, 3);
        FrameState state = states[static_cast<size_t>(from)];
        run(*fresh, heap, state, 40 - from);
        EXPECT_EQ(state_hash(state), state_hash(states.back())) << "from frame " << from;
    }
}

// Each change of who sleeps numbers what is simulated anew, while it flows and breaks.
TEST(sleeping, numbering_anew_what_flows_and_breaks_gives_the_same_bits_as_beginning_anew) {
    Ground g;
    for (int k = 0; k < 3; ++k) g.add(2, Vec3(k - 1, 1, 0), k == 1);    // fall asleep after 12 frames and later
    for (int k = 1; k < 4; ++k) g.add(2, Vec3(k - 1, 2, 0.3 * k * k));  // one after the other
    for (int k = 0; k < 3; ++k) {
        g.add(4, Vec3(k - 1, 0, 1.2 + 1.2 * k), false, Vec3(0, 0, -4));
        Material& m = g.input.materials.back();
        m.yield = 0.01, m.flow_rate = 300, m.toughness = 0.06;
    }
    const auto solver = test::make_solver(g.scene);
    std::vector<FrameState> states = {solver->initial_state(g.input.materials)};
    size_t n_changes = 0, n_broken = 0, n_flowed = 0;
    for (int f = 0; f < 72; ++f) {
        states.push_back(states.back());
        const StepReport report = advance(*solver, g.input, g.settings, states.back());
        const FrameState &before = states[states.size() - 2], &now = states.back();
        if (std::ranges::count(before.asleep, 1) == 0) continue;
        n_changes += before.asleep != now.asleep;
        bool falls_asleep = false;
        for (size_t i = 0; i < now.asleep.size(); ++i) falls_asleep |= now.asleep[i] > before.asleep[i];
        EXPECT_TRUE(!falls_asleep || (f + 1) % 6 == 0) << "kSleepInterval is six frames of 24 a second";
        n_broken += report.edges_broken;
        n_flowed += before.plastic_deformation != now.plastic_deformation;
    }
    EXPECT_GT(n_changes, 3u);
    EXPECT_GT(n_broken, 10u);
    EXPECT_GT(n_flowed, 3u);
    for (int from = 10; from < 72; from += 5) {
        const auto fresh = test::make_solver(g.scene);
        FrameState state = states[static_cast<size_t>(from)];
        for (int f = from; f < from + 5 && f < 72; ++f) {
            run(*fresh, g, state, 1);
            ASSERT_EQ(state_hash(state), state_hash(states[static_cast<size_t>(f) + 1])) << from << " to " << f;
        }
    }
}

// Fragments that broke off and that a ball wakes, one after the other, are not numbered anew with all else. Some are
// pinned, and one wakes far from all that is awake.
TEST(sleeping, what_wakes_by_itself_goes_on_with_the_bits_of_a_scene_made_anew) {
    Ground g;
    SimulationMesh two = test::lattice_mesh({{1, 1, 2}, kSpacing, 6, 1000, {}});
    for (Vec3& x : two.rest_position) x *= 2;
    for (int k = 0; k < 32; ++k) {
        const Quat lies = Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitX());
        test::add_body(g.scene, two, {Vec3(0.4 * (k % 8), 0.2 * (k / 8), 0.05), lies});
        g.input.materials.push_back({});
    }
    g.add_sphere(Vec3(-3, 0.23, 0.1), Vec3(3, 0, 0));
    g.scene.rigid_bodies.back().mass = 100;
    test::add_pin(g.scene, [](const Vec3& x) { return std::abs(x.x() - 0.6) < 0.15 && x.y() < 0.3; });
    g.input.pins.resize(1);
    const auto solver = test::make_solver(g.scene);
    FrameState state = solver->initial_state(g.input.materials);
    state.edge_intact.assign(32, 0);
    run(*solver, g, state, 20);
    ASSERT_EQ(std::ranges::count(state.asleep, 1), 64);
    std::vector<FrameState> states = {state};
    const std::vector<ParticleId>& pinned = solver->scene().pins[0].particles;
    const auto set_friction = [&](int frame) { g.input.materials[31].friction = frame < 30 ? 0.5 : 0.4; };
    size_t n_woken = 0;
    bool pin_woke = false;
    for (int f = 0; f < 40; ++f) {
        set_friction(f);
        states.push_back(states.back());
        advance(*solver, g.input, g.settings, states.back());
        const FrameState &before = states[states.size() - 2], &now = states.back();
        for (size_t i = 0; i < now.asleep.size(); ++i) {
            n_woken += before.asleep[i] && !now.asleep[i];
            pin_woke |= before.asleep[i] && !now.asleep[i] && std::ranges::count(pinned, i) > 0;
        }
    }
    EXPECT_GT(n_woken, 8u);
    EXPECT_TRUE(pin_woke);
    EXPECT_TRUE(states[30].asleep[63] && !states[31].asleep[63]);
    for (int from = 0; from < 40; from += 4) {
        const auto fresh = test::make_solver(g.scene);
        state = states[static_cast<size_t>(from)];
        for (int f = from; f < from + 4; ++f) {
            set_friction(f);
            run(*fresh, g, state, 1);
            ASSERT_EQ(state_hash(state), state_hash(states[static_cast<size_t>(f) + 1])) << from << " to " << f;
        }
    }
}

// A ball that sinks slowly wakes the uppermost of three cubes, far from what that lies on.
TEST(sleeping, what_wakes_keeps_the_forces_of_what_it_lies_on) {
    Ground g;
    const SimulationMesh one = test::lattice_mesh({{1, 1, 1}, kSpacing, 6, 1000, {}});
    for (int k = 0; k < 3; ++k) {
        test::add_body(g.scene, one, {Vec3(0, 0, (k + 0.5) * kSpacing), Quat::Identity()});
        g.input.materials.push_back({});
    }
    g.add_sphere(Vec3(0.01, 0, 0.47), Vec3::Zero());
    g.scene.rigid_bodies.back().shape.radius = 0.03, g.scene.rigid_bodies.back().mass = 0.02;
    g.input.forces.push_back({Vec3::Zero(), Vec3::Zero(), 80});  // falls by 0.12 m/s
    const auto solver = test::make_solver(g.scene);
    FrameState state = solver->initial_state(g.input.materials);
    bool woke = false;
    for (int f = 0; f < 48; ++f) {
        FrameState fresh = state;
        run(*solver, g, state, 1);
        run(*test::make_solver(g.scene), g, fresh, 1);
        ASSERT_EQ(state_hash(state), state_hash(fresh)) << f;
        woke |= !fresh.asleep[2] && fresh.asleep[1];
    }
    EXPECT_TRUE(woke);
}

TEST(sleeping, a_heap_ends_where_it_does_awake) {
    Heap heap;
    heap.scene.rigid_bodies.clear();
    std::vector<Vec3> end[2];
    for (const bool sleeping : {false, true}) {
        heap.settings.sleeping = sleeping;
        const auto solver = test::make_solver(heap.scene);
        FrameState state = solver->initial_state(heap.input.materials);
        const StepReport last = run(*solver, heap, state, 96);
        EXPECT_EQ(last.asleep, sleeping ? heap.scene.rest.n_particles() : 0);
        end[sleeping] = state.position;
    }
    double apart = 0;
    for (size_t i = 0; i < end[0].size(); ++i) apart = std::max(apart, (end[0][i] - end[1][i]).norm());
    EXPECT_LT(apart, 0.05 * kSpacing);
}

}  // namespace
}  // namespace sunder
