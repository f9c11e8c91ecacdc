// Contacts where solvers drift, explode, tunnel or slide: stacks, piles, overlap, speed, mass ratio, slopes.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/energy.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

struct Ground {
    Scene scene;
    Material material;
    SolverSettings settings;
    std::unique_ptr<Solver> solver;
    FrameState state;
    Vec3 gravity = Vec3(0, 0, -9.81);

    Ground() {
        scene.colliders.resize(1);
        scene.colliders[0].name = "floor";
        scene.colliders[0].shape.kind = ShapeKind::plane;
        material.youngs_modulus = 1e6;
    }
    void start() {
        solver = test::make_solver(scene);
        state = solver->initial_state(std::vector<Material>(scene.bodies.size(), material));
    }
    void frame() {
        FrameInput in = test::quiet_input(scene, material);
        in.gravity = gravity;
        test::advance(*solver, in, settings, state);
    }
    double energy() const { return test::energy(solver->scene(), material, gravity, state).total(); }
    double fastest() const {
        double v = 0;
        for (const Vec3& x : state.velocity) v = std::max(v, x.norm());
        for (const RigidBodyState& r : state.rigid_bodies) v = std::max(v, r.velocity.norm());
        return v;
    }
};

RigidBody box(const Vec3& position, double mass, double half) {
    RigidBody b;
    b.name = "box";
    b.shape.kind = ShapeKind::box;
    b.shape.half_extents = Vec3::Constant(half);
    b.mass = mass;
    b.pose.position = position;
    return b;
}

struct StackResult {
    double drift, jitter, rise;  // m, m/s, share of the energy
};

// Two seconds to settle, ten to stand.
StackResult stand(Ground& g) {
    g.start();
    for (int f = 0; f < 48; ++f) g.frame();
    const FrameState settled = g.state;
    const double start = g.energy();
    StackResult result{0, 0, 0};
    for (int f = 0; f < 240; ++f) {
        g.frame();
        result.jitter = std::max(result.jitter, g.fastest());
        result.rise = std::max(result.rise, g.energy() / start - 1);
    }
    for (size_t i = 0; i < settled.n_particles(); ++i)
        result.drift = std::max(result.drift, (g.state.position[i] - settled.position[i]).norm());
    for (size_t r = 0; r < settled.rigid_bodies.size(); ++r)
        result.drift =
            std::max(result.drift, (g.state.rigid_bodies[r].position - settled.rigid_bodies[r].position).norm());
    std::printf("stack: drift %.2e m, fastest %.2e m/s, energy rose by %.1e of itself\n", result.drift, result.jitter,
                result.rise);
    return result;
}

// A picture a thousand pixels wide that shows the stack has pixels of 1 mm: no drift to be seen in ten seconds, and no
// flicker of more from frame to frame.
constexpr double kPixel = 1e-3, kFlicker = 0.024;  // m, m/s

TEST(stack, ten_boxes_stand_for_ten_seconds) {
    Ground g;
    for (int k = 0; k < 10; ++k) {
        g.scene.rigid_bodies.push_back(box(Vec3(0, 0, 0.1 * k + 0.05), 4, 0.05));
        g.scene.rigid_bodies.back().shape.half_extents = Vec3(0.1, 0.1, 0.05);
    }
    const StackResult r = stand(g);
    EXPECT_LE(r.drift, kPixel);
    EXPECT_LE(r.jitter, kFlicker);
    EXPECT_LE(r.rise, 1e-3);
}

// Those below come to rest first: what sleeps carries what still rocks on it, and turns by none of it.
TEST(stack, boxes_that_rock_come_to_rest_one_by_one_and_stand) {
    for (const unsigned seed : {2u, 3u, 4u, 5u, 6u}) {
        Ground g;
        std::mt19937_64 rng(seed);
        std::uniform_real_distribution<double> uniform(-1, 1);
        for (int k = 0; k < 10; ++k) {
            RigidBody b = box(Vec3(0, 0, 0.1 * k + 0.05), 4, 0.05);
            b.shape.half_extents = Vec3(0.1, 0.1, 0.05);
            b.velocity = 0.1 * Vec3(uniform(rng), uniform(rng), 0);
            b.angular_velocity = Vec3(0.3 * uniform(rng), 0.3 * uniform(rng), uniform(rng));
            g.scene.rigid_bodies.push_back(b);
        }
        const StackResult r = stand(g);
        EXPECT_LE(r.drift, kPixel);
        EXPECT_LE(r.jitter, kFlicker);
        EXPECT_EQ(std::ranges::count(g.state.asleep, 1), 10);
    }
}

// Every other one a body of irregular ellipsoids: three or four of them carry the box above.
TEST(stack, ten_of_boxes_and_fragments_stand_for_ten_seconds) {
    Ground g;
    SimulationMesh slab = test::lattice_mesh({{4, 4, 2}, 0.05, 26, 1000, {}});
    std::mt19937_64 rng(3);
    std::uniform_real_distribution<double> uniform(0.85, 1.0);
    for (Vec3& r : slab.radii) r = r.cwiseProduct(Vec3(uniform(rng), uniform(rng), uniform(rng)));
    for (int k = 0; k < 10; ++k) {
        if (k % 2 == 0) {
            g.scene.rigid_bodies.push_back(box(Vec3(0, 0, 0.1 * k + 0.05), 4, 0.05));
            g.scene.rigid_bodies.back().shape.half_extents = Vec3(0.1, 0.1, 0.05);
        } else {
            test::add_body(g.scene, slab, {Vec3(0, 0, 0.1 * k), Quat::Identity()});
        }
    }
    const StackResult r = stand(g);
    EXPECT_LE(r.drift, kPixel);
    EXPECT_LE(r.jitter, kFlicker);
    EXPECT_LE(r.rise, 1e-3);
}

TEST(pile, a_body_torn_to_bits_comes_to_rest) {
    Ground g;
    SimulationMesh mesh = test::lattice_mesh({{5, 5, 5}, 0.06, 6, 1000, {}});
    std::mt19937_64 rng(5);
    std::uniform_real_distribution<double> uniform(0.6, 1.0);
    for (Vec3& r : mesh.radii) r = r.cwiseProduct(Vec3(uniform(rng), uniform(rng), uniform(rng)));
    test::add_body(g.scene, mesh, {Vec3(0, 0, 0.3), Quat(Eigen::AngleAxisd(0.5, Vec3(1, 0.3, 0).normalized()))});
    g.start();
    for (size_t e = 0; e < g.state.edge_intact.size(); ++e) g.state.edge_intact[e] = uniform(rng) < 0.7;  // a quarter
    double last = g.energy(), rise = 0;
    for (int f = 0; f < 192; ++f) {
        g.frame();
        const double now = g.energy();
        rise = std::max(rise, now - last), last = now;
    }
    std::printf("pile: %zu pieces, fastest after 8 s %.2e m/s, energy rose by %.2e J in a frame\n",
                test::count_pieces(g.solver->scene().rest, g.state), g.fastest(), rise);
    EXPECT_LE(rise, 1e-2);  // J, of 80
    EXPECT_LE(g.fastest(), kFlicker);
    for (const Vec3& x : g.state.position) EXPECT_GT(x.z(), 0);
}

struct Settled {
    double start, highest;  // J: kinetic and of height, when bodies were let go and at most since
    double median, most;    // m/s: of the means over the fragments' paths in the seventh second; nine tenths are slower
};

// Bodies that lost two edges of three, awake.
Settled drop_torn_bodies(double modulus, int substeps) {
    constexpr int kFrames = 24;
    Ground g;
    g.material.youngs_modulus = modulus;
    g.settings.substeps = substeps;
    g.settings.sleeping = false;
    std::mt19937_64 rng(7);
    std::uniform_real_distribution<double> uniform(0, 1);
    SimulationMesh mesh = test::lattice_mesh({{5, 5, 5}, 0.06, 6, 1000, {}});
    for (Vec3& r : mesh.radii) r *= 0.7 + 0.3 * uniform(rng);
    for (int k = 0; k < 12; ++k) {
        const Vec3 place = 0.6 * Vec3(k % 2, k / 2 % 2, k / 4) + Vec3(0, 0, 0.3);
        const Vec3 axis = Vec3(uniform(rng) - 0.5, uniform(rng) - 0.5, uniform(rng) - 0.5).normalized();
        test::add_body(g.scene, mesh, {place, Quat(Eigen::AngleAxisd(2 * uniform(rng), axis))});
    }
    g.start();
    for (uint8_t& intact : g.state.edge_intact) intact = uniform(rng) < 0.35;
    // Without the strain, which stiff bodies and long substeps leave unresolved for a while.
    const auto energy = [&] {
        const test::Energy e = test::energy(g.solver->scene(), g.material, g.gravity, g.state);
        return e.kinetic() + e.height;
    };
    Settled result{energy(), 0, 0, 0};
    for (int f = 0; f < 144; ++f) g.frame(), result.highest = std::max(result.highest, energy());
    std::vector<double> speed(g.state.n_particles(), 0);
    for (int f = 0; f < kFrames; ++f) {
        const std::vector<Vec3> before = g.state.position;
        g.frame();
        for (size_t i = 0; i < speed.size(); ++i) speed[i] += (g.state.position[i] - before[i]).norm() * 24 / kFrames;
    }
    std::ranges::sort(speed);
    result.median = speed[speed.size() / 2], result.most = speed[speed.size() * 9 / 10];
    std::printf(
        "heap of %.0e Pa, %d substeps: %zu pieces, energy %.0f J, %.0f at most, creep %.2f mm/s in the median, %.2f at "
        "the 90th percentile\n",
        modulus, substeps, test::count_pieces(g.solver->scene().rest, g.state), result.start, result.highest,
        1e3 * result.median, 1e3 * result.most);
    return result;
}

// At two substeps: what Newton steps do not reach in stiff chains of fragments is what such heaps fly apart by.
TEST(heap, torn_bodies_gain_nothing_however_stiff) {
    for (const double modulus : {2e5, 1e7, 1e9}) {
        const Settled heap = drop_torn_bodies(modulus, 2);
        EXPECT_LE(heap.highest, heap.start);
        EXPECT_LE(heap.median, kFlicker);
    }
}

// What passes over contacts leave undone is what heaps creep by. Eight heaps of 10 MPa and eight of 1 GPa crept by 0.05
// to 1.3 mm/s in the median; at the 90th percentile by 0.3 to 12, but two, in which a clump still rolled on, by 25 and
// 26: hence the second slowest of three.
TEST(heap, torn_bodies_come_to_rest_however_stiff) {
    std::vector<double> most;
    for (const double modulus : {2e5, 1e7, 1e9}) {
        const Settled heap = drop_torn_bodies(modulus, 4);
        EXPECT_LE(heap.highest, heap.start);
        EXPECT_LE(heap.median, 0.1 * kFlicker);
        most.push_back(heap.most);
    }
    std::ranges::sort(most);
    EXPECT_LE(most[1], kFlicker);
    EXPECT_LE(most[2], 2 * kFlicker);
}

// Bends like a reed on the floor. Friction that measured slip by the turning of particles and pushed their pieces fed
// such a sway as fast as the steps damped it: 2 and 7 cm/s in the mean, for ever.
TEST(column, a_soft_one_that_sways_comes_to_rest) {
    struct Column {
        test::LatticeBody body;
        int substeps;
    };
    for (const Column& column : {Column{{{3, 3, 8}, 0.1, 6, 1000, {}}, 8}, {{{4, 4, 10}, 0.1, 26, 1000, {}}, 16}}) {
        Ground g;
        g.material.youngs_modulus = 2e5;
        g.settings.substeps = column.substeps;
        g.settings.sleeping = false;
        test::add_body(g.scene, test::lattice_mesh(column.body));
        g.start();
        for (size_t i = 0; i < g.state.n_particles(); ++i)
            g.state.velocity[i] = g.state.position[i].z() * Vec3(0.2, 0.1, 0);
        for (int f = 0; f < 192; ++f) g.frame();
        double fastest = 0;
        for (int f = 0; f < 48; ++f) g.frame(), fastest = std::max(fastest, g.fastest());
        std::printf("column: fastest after 8 s %.2e m/s\n", fastest);
        EXPECT_LE(fastest, 0.2 * kFlicker);  // a fifth of a pixel a frame
    }
}

TEST(overlap, two_bodies_in_one_another_part_at_the_depenetration_speed) {
    Ground g;
    g.gravity.setZero();
    g.scene.colliders.clear();
    const SimulationMesh cube = test::lattice_mesh({{4, 4, 4}, 0.05, 26, 1000, {}});
    test::add_body(g.scene, cube);
    test::add_body(g.scene, cube, {Vec3(0.09, 0.013, 0.021), Quat(Eigen::AngleAxisd(0.3, Vec3::UnitZ()))});
    for (double speed : {0.1, 1.0}) {
        g.settings.depenetration_speed = speed;
        g.start();
        double fastest = 0;
        for (int f = 0; f < 96; ++f) {
            g.frame();
            fastest = std::max(fastest, g.fastest());
        }
        std::printf("overlap at %.1f m/s: fastest %.3f m/s\n", speed, fastest);
        // Each is pushed by no more than the whole; a cell squeezed between two may swing back with as much again.
        EXPECT_LE(fastest, 2 * speed);
    }
}

TEST(tunnelling, ten_times_a_fast_shot_does_not_cross_a_thin_plate) {
    for (double speed : {9.6, 96.0}) {  // a plate's thickness of 0.05 m a substep, and ten
        Ground g;
        g.gravity.setZero();
        g.scene.colliders.clear();
        g.material.youngs_modulus = 1e7;
        test::add_body(g.scene, test::lattice_mesh({{12, 12, 1}, 0.05, 26, 1000, {}}));
        test::add_pin(g.scene, [](const Vec3& x) { return x.head<2>().cwiseAbs().maxCoeff() > 0.25; });
        const SimulationMesh shot = test::lattice_mesh({{1, 1, 1}, 0.05, 6, 1000, {}});
        for (int k = 0; k < 9; ++k)
            test::add_body(g.scene, shot, {Vec3(0.071 * (k % 3 - 1), 0.067 * (k / 3 - 1), 0.4), Quat::Identity()},
                           Vec3(0, 0, -speed));
        g.start();
        double lowest = 1e9;
        for (int f = 0; f < 24; ++f) {
            g.frame();
            for (size_t i = 144; i < g.state.n_particles(); ++i) {
                double plate = 1e9;
                for (size_t j = 0; j < 144; ++j)
                    if ((g.state.position[i] - g.state.position[j]).head<2>().norm() < 0.06)
                        plate = std::min(plate, g.state.position[j].z());
                if (plate < 1e9) lowest = std::min(lowest, g.state.position[i].z() - plate);
            }
        }
        std::printf("shots at %.0f m/s: nearest to the plate's centre %.3f m, fastest at the end %.1f m/s\n", speed,
                    lowest, g.fastest());
        EXPECT_LE(g.fastest(), speed);
        EXPECT_GT(lowest, 0);  // on the side they came from
    }
}

TEST(mass_ratio, a_thousandfold_weight_rests_on_a_light_piece) {
    Ground g;
    const SimulationMesh cell = test::lattice_mesh({{1, 1, 1}, 0.1, 6, 100, {}});  // 0.1 kg
    for (int k = 0; k < 4; ++k)
        test::add_body(g.scene, cell, {Vec3(0.12 * (k % 2) - 0.06, 0.12 * (k / 2) - 0.06, 0), Quat::Identity()});
    g.scene.rigid_bodies = {box(Vec3(0, 0, 0.2), 400, 0.1)};  // 1000 to 1 on each
    g.start();
    double deepest = 1e9, highest = -1e9;
    for (int f = 0; f < 120; ++f) {
        g.frame();
        deepest = std::min(deepest, g.state.rigid_bodies[0].position.z());
        highest = std::max(highest, g.state.rigid_bodies[0].position.z());
    }
    std::printf("400 kg on 4 x 0.1 kg: sank %.2e m, rose %.2e m, fastest %.2e m/s\n", 0.2 - deepest, highest - 0.2,
                g.fastest());
    EXPECT_LE(highest - 0.2, 1e-3);
    EXPECT_LE(g.fastest(), kFlicker);
    EXPECT_LE(0.2 - deepest, 0.01);  // a tenth of the piece under it
}

TEST(slope, bodies_stick_below_the_angle_of_friction_and_slide_at_the_right_pace_above) {
    for (double stiffness : {2e5, 1e8})
        for (double steepness : {0.8, 1.4}) {
            Ground g;
            g.material.youngs_modulus = stiffness;
            g.material.friction = g.scene.colliders[0].friction = 0.5;
            test::add_body(g.scene, test::lattice_mesh({{6, 6, 2}, 0.05, 26, 1000, {}}));
            const double angle = std::atan(0.5 * steepness);
            g.gravity = 9.81 * Vec3(std::sin(angle), 0, -std::cos(angle));
            g.start();
            const auto place = [&] {
                double x = 0;
                for (const Vec3& p : g.state.position) x += p.x() / double(g.state.n_particles());
                return x;
            };
            for (int f = 0; f < 12; ++f) g.frame();  // settles into its own weight
            double speed = 0;
            for (const Vec3& v : g.state.velocity) speed += v.x() / double(g.state.n_particles());
            const double start = place();
            for (int f = 0; f < 24; ++f) g.frame();
            const double moved = place() - start;
            const double pace = 9.81 * (std::sin(angle) - 0.5 * std::cos(angle));
            std::printf("slope %.2f of the limit, E %.0e: moved %.4f m in a second, sliding gives %.4f\n", steepness,
                        stiffness, moved, steepness > 1 ? speed + 0.5 * pace : 0.0);
            // Sticking: what is left is the creep of a solver with a tolerance, a millimetre a second at most.
            const double expected = steepness < 1 ? 0 : speed + 0.5 * pace;
            EXPECT_NEAR(moved, expected, 1e-3 + 0.02 * expected);
        }
}

}  // namespace
}  // namespace sunder
