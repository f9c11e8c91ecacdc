// What activations keep stands, or does not break, until its condition comes for it, and goes on from there.
#include <gtest/gtest.h>

#include <numeric>

#include "solver/frame/object_touch.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

Activation keep(const Scene& scene, Keeps keeps, Until until, const std::function<bool(const Vec3&)>& region) {
    Activation a;
    a.name = "keep", a.keeps = keeps, a.until = until;
    for (ParticleId i(0); i < scene.rest.n_particles(); ++i)
        if (region(scene.rest.rest_position[i])) a.particles.push_back(i);
    return a;
}
bool everywhere(const Vec3&) { return true; }

RigidBody ball(const Vec3& position, const Vec3& velocity, double mass = 2) {
    RigidBody b;
    b.name = "ball", b.shape.kind = ShapeKind::sphere, b.shape.radius = 0.1, b.mass = mass;
    b.pose.position = position, b.velocity = velocity;
    return b;
}

Material stone() {
    Material m;
    m.youngs_modulus = 1e7;
    return m;
}

struct Shot {
    std::unique_ptr<Solver> solver;
    FrameInput input;
    SolverSettings settings;
    FrameState state;

    explicit Shot(const Scene& scene, const Material& material = stone(), int threads = 1)
        : solver(test::make_solver(scene, threads)), input(test::quiet_input(scene, material)) {
        state = solver->initial_state(input.materials);
    }
    void go_on(int frames) {
        for (int k = 0; k < frames; ++k) test::advance(*solver, input, settings, state);
    }
    // Whether it is where it was at rest, and has no velocity, to the bit.
    bool stands(ParticleIndex i) const {
        const SimulationMesh& rest = solver->scene().rest;
        return state.position[i] == rest.rest_position[i] && state.velocity[i] == Vec3(Vec3::Zero()) &&
               state.orientation[i].coeffs() == rest.rest_orientation[i].coeffs();
    }
    size_t n_standing() const {
        size_t n = 0;
        for (size_t i = 0; i < state.n_particles(); ++i) n += stands(i);
        return n;
    }
    Vec3 momentum() const {
        const Scene& scene = solver->scene();
        Vec3 sum = Vec3::Zero();
        for (size_t i = 0; i < state.n_particles(); ++i) sum += scene.rest.mass[i] * state.velocity[i];
        for (size_t r = 0; r < state.rigid_bodies.size(); ++r)
            sum += scene.rigid_bodies[r].mass * state.rigid_bodies[r].velocity;
        return sum;
    }
};

Scene block() { return test::lattice_scene({.cells = {3, 3, 3}, .spacing = 0.1, .neighbours = 26}); }

TEST(activation, what_is_held_stands_to_the_bit_and_falls_from_its_frame_on) {
    Scene scene = block();
    scene.bodies[0].velocity = Vec3(1, 0, 0);  // it has none where it is held
    scene.activations = {keep(scene, Keeps::held, Until::frame, everywhere)};
    Shot shot(scene);
    shot.input.gravity = Vec3(0, 0, -10);
    shot.go_on(30);  // it falls asleep
    EXPECT_EQ(shot.n_standing(), 27u);
    shot.input.activations[0].comes = true;
    shot.go_on(1);
    EXPECT_EQ(shot.n_standing(), 0u);
    for (const Vec3& v : shot.state.velocity) EXPECT_NEAR((v - Vec3(0, 0, -10.0 / 24)).norm(), 0, 1e-9);
}

// As one that a pin holds: what hangs on it hangs as there.
TEST(activation, what_is_held_bears_as_what_a_pin_holds) {
    const auto end = [](const Vec3& x) { return x.x() < -0.3; };
    Scene pinned = test::lattice_scene({.cells = {8, 2, 2}, .spacing = 0.1, .neighbours = 26}), held = pinned;
    test::add_pin(pinned, end);
    held.activations = {keep(held, Keeps::held, Until::frame, end)};
    Shot a(pinned), b(held);
    a.input.gravity = b.input.gravity = Vec3(0, 0, -10);
    a.go_on(12), b.go_on(12);
    double most = 0, sag = 0;
    for (size_t i = 0; i < a.state.n_particles(); ++i) {
        most = std::max(most, (a.state.position[i] - b.state.position[i]).norm());
        sag = std::max(sag, (a.state.position[i] - pinned.rest.rest_position[i]).norm());
    }
    EXPECT_GT(sag, 1e-3);
    EXPECT_LT(most, 1e-6 * sag);
    // What hangs on it when it lets go has its momentum, and all of it falls.
    const Vec3 before = b.momentum();
    double mass = std::accumulate(held.rest.mass.begin(), held.rest.mass.end(), 0.0);
    b.input.activations[0].comes = true;
    b.go_on(6);
    EXPECT_LT((b.momentum() - before - mass * Vec3(0, 0, -10) * 6 / 24).norm(), 1e-9 * mass);
}

TEST(activation, a_touch_lets_go_within_the_step_and_all_momentum_is_there) {
    Scene scene = block();
    scene.activations = {keep(scene, Keeps::held, Until::contact, everywhere)};
    scene.rigid_bodies = {ball({-0.5, 0, 0.15}, {4, 0, 0})};
    Shot shot(scene);
    shot.go_on(1);
    EXPECT_EQ(shot.n_standing(), 27u);  // 0.17 of 0.25 m
    shot.go_on(3);
    EXPECT_LT(shot.n_standing(), 27u);
    EXPECT_GT(shot.n_standing(), 9u) << "only what was touched is let go, and the far side bears it";

    scene.activations[0].keeps = Keeps::asleep;
    Shot whole(scene);
    whole.go_on(4);
    EXPECT_EQ(whole.n_standing(), 0u);
    EXPECT_LT((whole.momentum() - Vec3(8, 0, 0)).norm(), 1e-9 * 8) << "of what a step gave back";
}

TEST(activation, a_hit_lets_go_above_its_impulse_and_not_below) {
    for (const double impulse : {6.0, 7.9, 8.2, 12.0})
        for (const double from : {-0.5, -0.52, -0.47, -0.41})
            for (const int substeps : {1, 2, 3, 8}) {
                Scene scene = block();
                scene.activations = {keep(scene, Keeps::held, Until::contact, everywhere)};
                scene.activations[0].impulse = impulse;
                // On the middle of a fragment's face, and it does not bounce: all of 2 kg times 4 m/s, or less than
                // all. Wherever in a step it comes there.
                scene.rigid_bodies = {ball({from, 0, 0.15}, {4, 0, 0})};
                Shot shot(scene);
                shot.settings.substeps = substeps;
                shot.go_on(5);
                EXPECT_EQ(shot.n_standing() == 27, impulse > 8)
                    << impulse << " N s, from " << from << ", " << substeps << " substeps";
            }
}

TEST(activation, what_weighs_on_it_does_not_add_up) {
    Scene scene = block();
    scene.activations = {keep(scene, Keeps::held, Until::contact, everywhere)};
    scene.activations[0].impulse = 2 * 20.0 / 24 * 1.5;  // of two frames, half as much again
    scene.rigid_bodies = {ball({0, 0, 0.4}, {0, 0, 0})};
    scene.rigid_bodies[0].shape.kind = ShapeKind::box, scene.rigid_bodies[0].shape.half_extents = Vec3::Constant(0.1);
    Shot shot(scene);
    shot.input.gravity = Vec3(0, 0, -10);
    shot.go_on(72);
    EXPECT_EQ(shot.n_standing(), 27u);
    EXPECT_NEAR(shot.state.rigid_bodies[0].position.z(), 0.4, 0.01);
}

TEST(activation, a_collider_that_comes_upon_it_lets_it_go_whatever_the_impulse) {
    Scene scene = block();
    scene.activations = {keep(scene, Keeps::held, Until::contact, everywhere)};
    scene.activations[0].impulse = 1e9;
    scene.colliders.resize(1);
    scene.colliders[0].shape.radius = 0.1;
    Shot shot(scene);
    double x = -0.5;
    for (int frame = 0; frame < 12; ++frame, x += 0.06) {
        shot.input.colliders[0].begin.position = {x, 0, 0.15};
        shot.input.colliders[0].end.position = {x + 0.06, 0, 0.15};
        shot.go_on(1);
        EXPECT_EQ(shot.n_standing() < 27, x + 0.06 > -0.25) << "at " << x;
        if (shot.n_standing() < 27) break;
    }
}

// A strip that is pulled until it breaks, but for its middle.
struct Pulled {
    Scene scene = test::lattice_scene({.cells = {1, 1, 12}, .spacing = 0.1});
    Material material = stone();
    Pulled() {
        test::add_pin(scene, [](const Vec3& x) { return x.z() < 0.1; });
        test::add_pin(scene, [](const Vec3& x) { return x.z() > 1.1; });
        material.toughness = 0.02;
    }
    static void pull(Shot& shot, int frame) {
        shot.input.pins[1].begin.position.z() = 0.005 * frame,
        shot.input.pins[1].end.position.z() = 0.005 * (frame + 1);
        shot.go_on(1);
    }
};

TEST(activation, what_is_glued_does_not_break_before_its_frame) {
    for (const double energy : {kNever, 5.0}) {
        Pulled strip;
        strip.material.fracture_energy = energy;
        strip.scene.activations = {keep(strip.scene, Keeps::glued, Until::frame, everywhere)};
        Shot shot(strip.scene, strip.material);
        for (int frame = 0; frame < 20; ++frame) Pulled::pull(shot, frame);
        EXPECT_EQ(test::count_broken(shot.state), 0u) << "fracture energy " << energy;
        EXPECT_GT(*std::ranges::max_element(shot.state.strain), 2 * strip.material.toughness);
        EXPECT_TRUE(shot.state.edge_bond.empty());
        shot.input.activations[0].comes = true;
        Pulled::pull(shot, 20);
        EXPECT_GT(test::count_broken(shot.state), 0u) << "fracture energy " << energy;
    }
}

// Where it is at its limit: glue beside a tear has the tear go round it.
TEST(activation, a_tear_goes_round_glue) {
    Pulled strip;
    const auto middle = [](const Vec3& x) { return std::abs(x.z() - 0.6) < 0.3; };
    strip.scene.activations = {keep(strip.scene, Keeps::glued, Until::frame, middle)};
    Shot shot(strip.scene, strip.material);
    for (int frame = 0; frame < 20; ++frame) Pulled::pull(shot, frame);
    EXPECT_GT(test::count_broken(shot.state), 0u);
    for (size_t e = 0; e < shot.state.edge_intact.size(); ++e) {
        const Edge& edge = strip.scene.rest.edges[e];
        if (middle(strip.scene.rest.rest_position[edge.a]) || middle(strip.scene.rest.rest_position[edge.b])) {
            EXPECT_EQ(shot.state.edge_intact[e], 1) << "edge " << e;
        }
    }
}

TEST(activation, a_break_lets_go_of_what_is_beside_it) {
    Pulled strip;
    strip.scene.rest.edges[4].toughness_factor = 0.5;  // between fragments 4 and 5, where it will break
    strip.scene.activations = {
        keep(strip.scene, Keeps::held, Until::neighbour, [](const Vec3& x) { return x.z() < 0.5; })};
    Shot shot(strip.scene, strip.material);
    shot.input.gravity = Vec3(1, 0, 0);  // across
    int frame = 0;
    while (test::count_broken(shot.state) == 0 && frame < 30) {
        EXPECT_GE(shot.n_standing(), 5u);
        Pulled::pull(shot, frame++);
    }
    ASSERT_GT(test::count_broken(shot.state), 0u);
    Pulled::pull(shot, frame);
    for (ParticleId i : shot.solver->scene().activations[0].particles)
        EXPECT_EQ(shot.state.inactive[i].what == 0, i >= 3) << "fragment " << i;
}

// A wall of fragments that all hang on nothing, so that each stands for itself.
Scene wall() {
    Scene scene = test::lattice_scene({.cells = {8, 1, 8}, .spacing = 0.1});
    scene.rest.edges.clear();
    scene.bodies[0].edge_end = 0;
    Activation a = keep(scene, Keeps::held, Until::object, everywhere);
    a.object.kind = ShapeKind::sphere, a.object.radius = 0.12;
    scene.activations = {a};
    return scene;
}

double distance_to_box(const Vec3& x, const Vec3& center, double half) {
    return ((x - center).cwiseAbs() - Vec3::Constant(half)).cwiseMax(0.0).norm();
}

// Where the middle of the ball is at the end of a frame: along the wall, and it dips through it.
Vec3 ball_at(int frame) { return {-0.6 + 0.11 * frame, 0.02 * frame - 0.1, 0.35 + 0.03 * frame}; }

TEST(activation, a_ball_that_sweeps_a_wall_lets_go_of_what_it_touches_in_that_frame) {
    const Scene scene = wall();
    Shot shot(scene);
    shot.input.gravity = Vec3(0, 0, -10);
    std::vector<uint8_t> touched(scene.rest.n_particles(), 0);
    size_t n_touched = 0;
    for (int frame = 0; frame < 12; ++frame) {
        shot.input.activations[0].object.begin.position = ball_at(frame);
        shot.input.activations[0].object.end.position = ball_at(frame + 1);
        shot.go_on(1);
        for (size_t i = 0; i < touched.size(); ++i) {
            double least = 1;
            for (int k = 0; k <= 1000; ++k)
                least =
                    std::min(least, distance_to_box(ball_at(frame) + 0.001 * k * (ball_at(frame + 1) - ball_at(frame)),
                                                    scene.rest.rest_position[i], 0.05));
            if (std::abs(least - 0.12) > 2e-4)  // its places are 6 mm apart
                touched[i] |= least < 0.12;
            else
                touched[i] = !shot.stands(i);
            EXPECT_EQ(shot.stands(i), !touched[i]) << "fragment " << i << " at frame " << frame + 1 << ", " << least;
        }
        const size_t n = static_cast<size_t>(std::ranges::count(touched, 1));
        n_touched = std::max(n_touched, n);
    }
    EXPECT_GT(n_touched, 10u);
    EXPECT_LT(n_touched, 50u);
}

// From all that it touches to none at its falloff, straight between, and the same ones each time.
TEST(activation, with_falloff_it_lets_go_of_the_fewer_the_farther) {
    Scene scene = test::lattice_scene({.cells = {60, 1, 60}, .spacing = 0.1});
    scene.rest.edges.clear();
    scene.bodies[0].edge_end = 0;
    Activation a = keep(scene, Keeps::held, Until::object, everywhere);
    a.object.kind = ShapeKind::plane, a.falloff = 2;
    scene.activations = {a};
    std::vector<std::vector<uint8_t>> gone;
    for (int time = 0; time < 2; ++time) {
        Shot shot(scene);
        shot.input.gravity = Vec3(0, 0, -10);
        shot.input.activations[0].object.begin.position.z() = shot.input.activations[0].object.end.position.z() = 1;
        shot.go_on(1);
        gone.emplace_back();
        for (size_t i = 0; i < shot.state.n_particles(); ++i) gone.back().push_back(!shot.stands(i));
    }
    EXPECT_EQ(gone[0], gone[1]);
    std::vector<int> n_gone(60, 0);  // by height, of 60
    for (size_t i = 0; i < gone[0].size(); ++i)
        n_gone[static_cast<size_t>(scene.rest.rest_position[i].z() / 0.1)] += gone[0][i];
    for (size_t k = 0; k < n_gone.size(); ++k) {
        const double distance = 0.1 * static_cast<double>(k) - 1;  // of the fragments' lower faces
        if (distance < -0.01) {
            EXPECT_EQ(n_gone[k], 60) << distance;
        } else if (distance > 2 - 0.01) {
            EXPECT_EQ(n_gone[k], 0) << distance;
        } else {
            EXPECT_NEAR(n_gone[k] / 60.0, 1 - distance / 2, 0.25) << distance;  // four deviations of 60 draws
        }
    }
}

TEST(activation, a_front_spreads_from_what_was_touched_after_a_delay) {
    Scene scene = wall();
    scene.activations[0].delay = 2.0 / 24, scene.activations[0].growth = 2.4;  // 0.1 m a frame
    Shot shot(scene);
    shot.input.gravity = Vec3(0, 0, -10);
    shot.input.activations[0].object.begin.position = shot.input.activations[0].object.end.position = {-0.35, 0, 0};
    std::vector<int> frame_of(scene.rest.n_particles(), 0);
    for (int frame = 1; frame <= 14; ++frame) {
        shot.go_on(1);
        shot.input.activations[0].object.begin.position = shot.input.activations[0].object.end.position = {-9, 0, 0};
        for (size_t i = 0; i < frame_of.size(); ++i)
            if (!frame_of[i] && !shot.stands(i)) frame_of[i] = frame;
    }
    for (size_t i = 0; i < frame_of.size(); ++i) {
        double least = 1;  // from what was touched, at the corner
        for (const Vec3& from :
             {Vec3(-0.35, 0, 0.05), Vec3(-0.25, 0, 0.05), Vec3(-0.35, 0, 0.15), Vec3(-0.25, 0, 0.15)})
            least = std::min(least, (scene.rest.rest_position[i] - from).norm());
        EXPECT_EQ(frame_of[i], 3 + static_cast<int>(std::floor(least / 0.1 + 1e-4)))
            << "fragment " << i << ", " << least;
    }
}

TEST(activation, what_sleeps_is_not_simulated_until_something_touches_it) {
    Scene scene = block();
    scene.activations = {keep(scene, Keeps::asleep, Until::frame, everywhere)};
    scene.rigid_bodies = {ball({-1.05, 0, 0.15}, {2, 0, 0})};
    Shot shot(scene);
    shot.input.gravity = Vec3::Zero();
    const StepReport report = test::advance(*shot.solver, shot.input, shot.settings, shot.state);
    EXPECT_EQ(report.asleep, 27u);
    EXPECT_LE(report.simulated, report.substeps * 1u) << "the ball alone";
    while (shot.state.rigid_bodies[0].position.x() < -0.26) {
        EXPECT_EQ(shot.n_standing(), 27u);
        shot.go_on(1);
    }
    shot.go_on(2);
    EXPECT_EQ(shot.n_standing(), 0u);
    EXPECT_LT((shot.momentum() - Vec3(4, 0, 0)).norm(), 1e-8);
}

// Everything at once.
Scene mixed() {
    Scene scene = test::lattice_scene({.cells = {6, 2, 6}, .spacing = 0.1, .neighbours = 26});
    Activation held = keep(scene, Keeps::held, Until::object, [](const Vec3& x) { return x.x() > 0; });
    held.object.kind = ShapeKind::sphere, held.object.radius = 0.1, held.delay = 1.0 / 24, held.growth = 3;
    Activation hit = keep(scene, Keeps::held, Until::contact, [](const Vec3& x) { return x.x() < 0 && x.z() < 0.4; });
    hit.impulse = 1;
    const Activation glued = keep(scene, Keeps::glued, Until::neighbour, [](const Vec3& x) { return x.z() > 0.2; });
    scene.activations = {held, hit, glued};
    scene.rigid_bodies = {ball({-0.9, 0, 0.3}, {6, 0, 0.5}, 4)};
    return scene;
}

void sweep(Shot& shot, int frame) {
    shot.input.gravity = Vec3(0, 0, -10);
    shot.input.activations[0].object.begin.position = {0.8 - 0.05 * frame, 0, 0.5};
    shot.input.activations[0].object.end.position = {0.75 - 0.05 * frame, 0, 0.5};
    shot.go_on(1);
}

TEST(activation, going_on_from_any_frame_gives_the_same_bits_for_any_number_of_threads) {
    Material m = stone();
    m.toughness = 0.02, m.fracture_energy = 10, m.restitution = 0.3;
    Shot whole(mixed(), m);
    std::vector<uint64_t> hashes;
    for (int frame = 0; frame < 14; ++frame) {
        const FrameState before = whole.state;
        sweep(whole, frame);
        hashes.push_back(state_hash(whole.state));
        Shot resumed(mixed(), m, 3);
        resumed.state = before;
        sweep(resumed, frame);
        EXPECT_EQ(state_hash(resumed.state), hashes.back()) << "frame " << frame + 1;
        EXPECT_TRUE(resumed.state == whole.state);
    }
    size_t kept = 0;
    for (const Inactivity& i : whole.state.inactive) kept += i.what != 0;
    EXPECT_GT(kept, 0u);
    EXPECT_LT(kept, whole.state.inactive.size());
}

// Edges between the two halves of a block.
std::vector<EdgeId> halves(const Scene& scene) {
    std::vector<EdgeId> edges;
    for (EdgeId e(0); e < scene.rest.n_edges(); ++e) {
        const Edge& edge = scene.rest.edges[e];
        const double a = scene.rest.rest_position[edge.a].x(), b = scene.rest.rest_position[edge.b].x();
        if (std::min(a, b) < 0.05 && std::max(a, b) > 0.05) edges.push_back(e);
    }
    return edges;
}

TEST(seam, breaks_all_its_edges_in_its_frame_and_no_other) {
    Scene scene = block();
    scene.seams = {{"seam", halves(scene)}};
    ASSERT_GT(scene.seams[0].edges.size(), 9u);
    Shot shot(scene);
    shot.go_on(24);  // it sleeps
    EXPECT_EQ(test::count_broken(shot.state), 0u);
    EXPECT_TRUE(std::ranges::count(shot.state.asleep, 1) == 27);
    shot.input.seams[0] = 0;
    const StepReport report = test::advance(*shot.solver, shot.input, shot.settings, shot.state);
    EXPECT_EQ(report.edges_broken, scene.seams[0].edges.size());
    std::vector<EdgeId> broken;
    for (const BrokenEdge& b : shot.state.broken) broken.push_back(b.edge);
    EXPECT_EQ(broken, scene.seams[0].edges);
    for (const BrokenEdge& b : shot.state.broken) EXPECT_EQ(b.by, (Pusher{Pusher::Kind::seam, 0}));
    EXPECT_EQ(test::count_broken(shot.state), broken.size());
    EXPECT_EQ(test::count_pieces(scene.rest, shot.state), 2u);
    shot.go_on(1);
    EXPECT_EQ(test::count_broken(shot.state), broken.size());
}

TEST(seam, breaks_first_where_it_is_weak_and_not_where_it_is_held) {
    Pulled strip;
    const auto at = [&](double z) {
        std::vector<EdgeId> edges;
        for (EdgeId e(0); e < strip.scene.rest.n_edges(); ++e) {
            const Edge& edge = strip.scene.rest.edges[e];
            const auto& x = strip.scene.rest.rest_position;
            if (std::abs(0.5 * (x[edge.a].z() + x[edge.b].z()) - z) < 0.01) edges.push_back(e);
        }
        return edges;
    };
    strip.scene.seams = {{"weak", at(0.4)}, {"held", at(0.7)}};
    ASSERT_EQ(strip.scene.seams[0].edges.size(), 1u);
    Shot shot(strip.scene, strip.material);
    shot.input.seams = {0.3, kNever};
    int frame = 0;
    while (test::count_broken(shot.state) == 0 && frame < 30) Pulled::pull(shot, frame++);
    EXPECT_EQ(shot.state.edge_intact[strip.scene.seams[0].edges[0]], 0);
    EXPECT_EQ(test::count_broken(shot.state), 1u);
    for (shot.input.seams[0] = 0; frame < 40;) Pulled::pull(shot, frame++);
    EXPECT_EQ(shot.state.edge_intact[strip.scene.seams[1].edges[0]], 1);
}

TEST(seam, factors_multiply_and_what_is_held_without_end_stays) {
    Pulled strip;
    std::vector<EdgeId> all;
    for (EdgeId e(0); e < strip.scene.rest.n_edges(); ++e) all.push_back(e);
    const auto hash_of = [&](const std::vector<double>& factors) {
        strip.scene.seams.assign(factors.size(), {"factor", all});
        Shot shot(strip.scene, strip.material);
        shot.input.seams = factors;
        for (int frame = 0; frame < 40; ++frame) Pulled::pull(shot, frame);
        return std::pair(state_hash(shot.state), test::count_broken(shot.state));
    };
    const auto twice = hash_of({0.5, 0.5}), once = hash_of({0.25}), none = hash_of({1}),
               held = hash_of({0.25, kNever, 0});
    EXPECT_EQ(twice, once);
    EXPECT_NE(once.first, none.first);
    EXPECT_GT(once.second, 0u);
    EXPECT_EQ(held.second, 0u);
}

TEST(seam, glue_holds_it_until_it_lets_go) {
    Scene scene = block();
    scene.seams = {{"seam", halves(scene)}};
    scene.activations = {keep(scene, Keeps::glued, Until::frame, everywhere)};
    Shot shot(scene);
    shot.input.seams[0] = 0;
    shot.go_on(2);
    EXPECT_EQ(test::count_broken(shot.state), 0u);
    shot.input.activations[0].comes = true;
    shot.go_on(1);
    EXPECT_EQ(test::count_broken(shot.state), scene.seams[0].edges.size());
}

TEST(activation, without_any_the_state_is_as_it_was) {
    Shot shot(block());
    shot.go_on(2);
    EXPECT_TRUE(shot.state.inactive.empty() && shot.state.edge_bond.empty());
}

}  // namespace
}  // namespace sunder
