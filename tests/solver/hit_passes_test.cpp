// Hits that break things on within a substep (SolverSettings::crack_passes).
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

using test::advance;

RigidBody ball(const Vec3& position, double mass, const Vec3& velocity) {
    RigidBody b;
    b.name = "ball";
    b.shape.radius = 0.15;
    b.mass = mass;
    b.pose.position = position;
    b.velocity = velocity;
    return b;
}

// A brittle block, hit by a weight from above.
struct Hit {
    Scene scene;
    std::vector<Material> materials = {Material()};
    SolverSettings settings;
    double gravity = 9.81;

    explicit Hit(double off_centre = 0) {
        test::LatticeBody block;
        block.cells = {10, 6, 4}, block.spacing = 0.1;
        test::add_body(scene, test::lattice_mesh(block));
        materials[0].youngs_modulus = 5e5, materials[0].toughness = 0.1;
        scene.rigid_bodies.push_back(ball(Vec3(off_centre, 0.04, 0.57), 300, Vec3(0, 0, -6)));
    }
    void add_floor() {
        Collider floor;
        floor.name = "floor", floor.shape.kind = ShapeKind::plane;
        scene.colliders.push_back(floor);
    }
    FrameInput input() const {
        FrameInput in = test::quiet_input(scene, Material());
        in.materials = materials, in.gravity = Vec3(0, 0, -gravity);
        return in;
    }
    FrameState start(const Solver& solver) const { return solver.initial_state(materials); }
};

double broken(int substeps, int passes) {
    double sum = 0;
    for (int place = -8; place <= 8; ++place) {  // what breaks varies from shot to shot
        Hit hit(0.01 * place);
        hit.add_floor();
        hit.settings.substeps = substeps, hit.settings.crack_passes = passes;
        const auto solver = test::make_solver(hit.scene);
        FrameState state = hit.start(*solver);
        for (int f = 0; f < 12; ++f) advance(*solver, hit.input(), hit.settings, state);
        sum += static_cast<double>(test::count_broken(state));
    }
    return sum;
}

// With one pass a third too little.
TEST(hit_passes, a_hit_breaks_as_much_with_few_substeps_as_with_many) {
    const double fine = broken(32, 4), coarse = broken(8, 4);
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
    once.substeps = again.substeps = 1, once.crack_passes = 1, again.crack_passes = 4;

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
