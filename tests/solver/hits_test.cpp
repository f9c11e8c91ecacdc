// Hits: substeps divided for them (SolverSettings::hit_substeps), and what breaks on within one (crack_passes).
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "tests/support/hit_scene.h"

namespace sunder {
namespace {

using test::advance, test::ball, test::Hit;

// `stiffer`: times. Hits of a speed strain what is stiffer by less, and its toughness is less by as much.
double broken(const SolverSettings& settings, double stiffer = 1) {
    double sum = 0;
    for (int place = -8; place <= 8; ++place) {  // what breaks varies from shot to shot
        Hit hit(0.01 * place);
        hit.add_floor();
        hit.materials[0].youngs_modulus *= stiffer, hit.materials[0].toughness /= std::sqrt(stiffer);
        const auto solver = test::make_solver(hit.scene);
        FrameState state = hit.start(*solver);
        for (int f = 0; f < 12; ++f) advance(*solver, hit.input(), settings, state);
        sum += static_cast<double>(test::count_broken(state));
    }
    return sum;
}

SolverSettings settings_of(int substeps, int iterations, int hit_substeps) {
    SolverSettings s;
    s.substeps = substeps, s.iterations = iterations, s.hit_substeps = hit_substeps;
    return s;
}

// Undivided, eight substeps break less than half as much of the stiffer block.
TEST(hit_substeps, a_hit_breaks_as_much_with_few_substeps_as_with_many) {
    double divided = 0;  // of the last
    for (const double stiffer : {1., 20.}) {
        const double fine = broken(settings_of(32, 1, 64), stiffer);
        for (const auto& [substeps, iterations] : {std::pair(4, 1), std::pair(8, 2)}) {
            const double coarse = broken(settings_of(substeps, iterations, 64), stiffer);
            std::printf("%g times as stiff, edges broken: %g at %d substeps, %g at 32\n", stiffer, coarse, substeps,
                        fine);
            EXPECT_GT(coarse, 0.75 * fine);  // in 17 shots the same settings vary by a twentieth
            EXPECT_LT(coarse, 1.25 * fine);
            divided = coarse;
        }
    }
    EXPECT_LT(broken(settings_of(8, 2, 1), 20), 0.6 * divided) << "else this tells nothing";
}

// A bar that stands upright comes down on the floor at v: strains of v / c run up through it, and it is crushed if it
// bears less, and not if it bears more. Undivided, ten times as stiff a bar loses 0 or 14 edges instead of some 270; it
// wants 23 parts.
TEST(hit_substeps, a_bar_breaks_where_the_strain_of_the_hit_exceeds_what_it_bears) {
    const auto crushed = [](double modulus, double borne, const SolverSettings& settings) {
        Hit hit;
        hit.scene = Scene(), hit.gravity = 0;
        test::LatticeBody bar;
        bar.cells = {4, 4, 20}, bar.spacing = 0.05;
        const double strain = 0.05, speed = strain * std::sqrt(modulus / bar.density);
        test::add_body(hit.scene, test::lattice_mesh(bar), {}, Vec3(0, 0, -speed));
        hit.add_floor();
        Material& m = hit.materials[0];
        m.youngs_modulus = modulus, m.toughness = 10, m.compressive_toughness = borne * strain;
        const auto solver = test::make_solver(hit.scene);
        FrameState state = hit.start(*solver);
        for (int f = 0; f < 4; ++f) advance(*solver, hit.input(), settings, state);
        return test::count_broken(state);
    };
    for (const double modulus : {1e6, 1e7}) {
        for (const double borne : {0.5, 0.7, 0.9}) {
            const size_t fine = crushed(modulus, borne, settings_of(256, 1, 1));
            const size_t divided = crushed(modulus, borne, settings_of(8, 2, 64));
            std::printf("%g Pa, bears %g of the strain: %zu edges, %zu at 256 substeps\n", modulus, borne, divided,
                        fine);
            EXPECT_GT(divided, 0.75 * static_cast<double>(fine));
            EXPECT_LT(divided, 1.25 * static_cast<double>(fine));
        }
        EXPECT_EQ(crushed(modulus, 1.2, settings_of(8, 2, 64)), 0u) << modulus;
    }
    EXPECT_LT(crushed(1e7, 0.5, settings_of(8, 2, 1)), 30u) << "else this tells nothing";
}

// Only what may break costs more, and only while it is hit.
TEST(hit_substeps, divide_substeps_in_which_a_hit_may_break_something_and_no_others) {
    struct Case {
        const char* what;
        double toughness;
        int most;
        Method method;
        bool divides;
    };
    for (const Case& c : {Case{"brittle", 0.1, 16, Method::projective, true},
                          {"by sweeps", 0.1, 16, Method::jacobi, false},
                          {"tough", 0.5, 16, Method::projective, false},
                          {"not to be divided", 0.1, 1, Method::projective, false},
                          {"by the paper's sweeps", 0.1, 16, Method::gauss_seidel, false}}) {
        Hit hit;  // at 7 m/s, strains of 0.3
        hit.scene.rigid_bodies[0].pose.position.z() += 0.5;
        hit.settings.method = c.method, hit.settings.hit_substeps = c.most, hit.settings.substeps = 4;
        hit.materials[0].toughness = c.toughness;
        const auto solver = test::make_solver(hit.scene);
        FrameState state = hit.start(*solver);
        int most = 0, first = 0;
        for (int f = 0; f < 8; ++f) {
            const int substeps = advance(*solver, hit.input(), hit.settings, state).substeps;
            if (f == 0) first = substeps;
            most = std::max(most, substeps);
        }
        EXPECT_EQ(first, 4) << c.what << ": it has not come down yet";
        EXPECT_EQ(most > 4, c.divides) << c.what;
        EXPECT_LE(most, 4 * std::max(c.most, 1)) << c.what;
    }
}

// What drives pins and colliders is where it is to be at the end of a frame, however its substeps were divided.
TEST(hit_substeps, driven_things_keep_their_time) {
    Hit hit;
    hit.scene.rigid_bodies.clear();
    Collider hammer;
    hammer.name = "hammer", hammer.shape.radius = 0.15;
    hit.scene.colliders.push_back(hammer);
    test::add_pin(hit.scene, [](const Vec3& x) { return x.x() < -0.4; });
    const auto solver = test::make_solver(hit.scene);
    FrameState state = hit.start(*solver);
    FrameInput in = hit.input();
    int most = 0;
    for (int f = 0; f < 8; ++f) {
        const auto path = [](int frame) { return Vec3(0.01 * frame, 0, 0.02 * frame); };
        const auto fall = [](int frame) { return Vec3(0.1, 0.04, 0.9 - 0.2 * frame); };
        in.pins[0] = {{path(f), Quat::Identity()}, {path(f + 1), Quat::Identity()}};
        in.colliders[0] = {{fall(f), Quat::Identity()}, {fall(f + 1), Quat::Identity()}};
        most = std::max(most, advance(*solver, in, hit.settings, state).substeps);
        for (const uint32_t j : hit.scene.pins[0].particles) {
            const Vec3 wanted = solver->scene().rest.rest_position[j] + path(f + 1);
            EXPECT_LT((state.position[j] - wanted).norm(), 1e-12) << "frame " << f;
        }
    }
    EXPECT_GT(most, hit.settings.substeps) << "else this tells nothing";
    EXPECT_GT(test::count_broken(state), 10u);
    EXPECT_NEAR(state.time, 8 * in.duration, 1e-12);
}

// With one pass a third too little.
TEST(hit_passes, a_hit_breaks_as_much_with_few_substeps_as_with_many) {
    const double fine = broken(settings_of(32, 2, 1)), coarse = broken(settings_of(8, 2, 1));
    std::printf("edges broken: %g at 8 substeps, %g at 32\n", coarse, fine);
    EXPECT_GT(coarse, 0.8 * fine);
    EXPECT_LT(coarse, 1.2 * fine);
}

// What hangs together with the cracks takes the substep again, and nothing else: far from the hit a soft block, a loose
// cube and a ball land and bounce, and another cube falls on a plank that pins hold, with one pass and with four alike.
TEST(hit_passes, what_breaks_elsewhere_changes_nothing) {
    Hit hit;
    hit.add_floor();
    const uint32_t first = hit.scene.bodies[0].particle_end;
    const auto add = [&](std::array<int, 3> cells, const Vec3& at, double angle, double speed) {
        test::LatticeBody body;
        body.cells = cells, body.spacing = 0.1;
        test::add_body(hit.scene, test::lattice_mesh(body), {at, Quat(Eigen::AngleAxisd(angle, Vec3::UnitX()))},
                       Vec3(0, 0, -speed));
        Material m;
        m.youngs_modulus = 1e6, m.restitution = 0.6, m.toughness = std::numeric_limits<double>::infinity();
        hit.materials.push_back(m);
    };
    add({3, 3, 3}, Vec3(20, 0, 0.06), 0.3, 3);
    add({1, 1, 1}, Vec3(22, 0, 0.05), 0.3, 3);
    add({6, 2, 1}, Vec3(24, 0, 0.3), 0, 0);
    test::add_pin(hit.scene, [](const Vec3& x) { return x.x() > 24.2; });
    add({1, 1, 1}, Vec3(23.8, 0, 0.42), 0, 3);
    hit.scene.rigid_bodies.push_back(ball(Vec3(26, 0, 0.17), 10, Vec3(1, 0, -3)));
    hit.scene.rigid_bodies.back().restitution = 0.6;
    FrameInput input = hit.input();
    input.duration /= hit.settings.substeps;
    SolverSettings once = hit.settings, again = hit.settings;
    once.substeps = again.substeps = once.hit_substeps = again.hit_substeps = 1;
    once.crack_passes = 1, again.crack_passes = 4;

    const auto solver = test::make_solver(hit.scene), other = test::make_solver(hit.scene);
    FrameState state = hit.start(*solver);
    size_t n_more = 0;
    for (int substep = 0; substep < 64; ++substep) {
        FrameState same = state;
        const size_t broke = advance(*solver, input, once, state).edges_broken;
        n_more += advance(*other, input, again, same).edges_broken > broke;
        double farthest = 0, fastest = 0;
        for (size_t i = first; i < state.n_particles(); ++i) {
            farthest = std::max(farthest, (state.position[i] - same.position[i]).norm());
            fastest = std::max(fastest, (state.velocity[i] - same.velocity[i]).norm());
        }
        EXPECT_EQ(farthest, 0) << "substep " << substep;
        EXPECT_EQ(fastest, 0) << "substep " << substep;
        EXPECT_EQ(state.rigid_bodies[1], same.rigid_bodies[1]) << "substep " << substep;
    }
    EXPECT_GE(n_more, 5u);
}

TEST(hit_passes, give_the_same_bits_on_any_number_of_threads_and_from_any_frame) {
    Hit hit;
    hit.add_floor();
    std::vector<uint64_t> hashes;
    FrameState middle;
    for (const int threads : {1, 2, 4}) {
        const auto solver = test::make_solver(hit.scene, threads);
        FrameState state = hit.start(*solver);
        for (int f = 0; f < 8; ++f) {
            if (f == 3) middle = state;
            advance(*solver, hit.input(), hit.settings, state);
        }
        EXPECT_GT(test::count_broken(state), 50u);
        hashes.push_back(state_hash(state));
    }
    EXPECT_GT(test::count_broken(middle), 10u);
    const auto solver = test::make_solver(hit.scene, 2);
    for (int f = 3; f < 8; ++f) advance(*solver, hit.input(), hit.settings, middle);
    hashes.push_back(state_hash(middle));
    for (const uint64_t hash : hashes) EXPECT_EQ(hash, hashes[0]);
}

TEST(hit_passes, linear_momentum_is_kept) {
    Hit hit;
    hit.gravity = 0;
    const auto solver = test::make_solver(hit.scene);
    const SimulationMesh& rest = solver->scene().rest;
    FrameState state = hit.start(*solver);
    const auto momentum = [&] {
        Vec3 p = hit.scene.rigid_bodies[0].mass * state.rigid_bodies[0].velocity;
        for (size_t i = 0; i < state.n_particles(); ++i) p += rest.mass[i] * state.velocity[i];
        return p;
    };
    const Vec3 before = momentum();
    for (int f = 0; f < 6; ++f) advance(*solver, hit.input(), hit.settings, state);
    EXPECT_GT(test::count_broken(state), 10u);
    EXPECT_LT((momentum() - before).norm(), 1e-9 * before.norm());
}

}  // namespace
}  // namespace sunder
