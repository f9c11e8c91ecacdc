#include <gtest/gtest.h>

#include <random>

#include "solver/jacobi_sweep.h"
#include "solver/motion.h"
#include "solver/newton_step.h"
#include "tests/support/lattice_scene.h"
#include "tests/support/plain_sweep.h"

namespace sunder {
namespace {

// A bar far from the origin, with flowed groups, broken edges, a held particle and everything out of place.
struct Disorder {
    SimulationMesh rest = test::lattice_mesh({{4, 4, 20}, 0.05, 6, 1000, {Vec3(300, -200, 100), Quat::Identity()}});
    LiveTopology live;
    GroupShapes shapes;
    std::vector<GroupStiffness> stiffness;
    std::vector<Mat3> inertia;
    std::vector<uint8_t> held;
    std::vector<MovingParticle> particles;
    std::vector<GroupGoal> goals;
    const double h = 1.0 / 192;
    std::vector<double> span;

    explicit Disorder(double size) {
        build_one_rings(rest);
        const size_t n = rest.n_particles();
        std::mt19937_64 rng(3);
        std::uniform_real_distribution<double> uniform(-1, 1);
        const auto vector = [&] { return Vec3(uniform(rng), uniform(rng), uniform(rng)); };
        std::vector<uint8_t> intact(rest.n_edges(), 1);
        for (size_t e = 0; e < intact.size(); e += 5) intact[e] = 0;
        live.reset(rest, intact);
        std::vector<Mat3> plastic(n, Mat3::Identity());
        for (size_t i = 0; i < n; i += 3) plastic[i].diagonal() = Vec3(1.2, 1 / 1.2, 1);
        shapes.reset(rest, live, plastic);
        Material material;
        material.youngs_modulus = 2e6, material.poisson_ratio = 0.3;
        held.assign(n, 0), held[7] = 1;
        span.assign(n, h);
        for (uint32_t i = 0; i < n; ++i) {
            stiffness.push_back(group_stiffness(shapes.group[i], shapes.rest_trace[i], rest.volume[i], material));
            MovingParticle p;
            p.x = rest.rest_position[i] + 0.05 * size * vector();
            p.x_inertial = p.x + 0.01 * size * vector();
            p.d = rotation_of(size * vector()), p.d_inertial = rotation_of(size * vector());
            p.D = p.d.toRotationMatrix();
            particles.push_back(p);
            goals.push_back({rotation_of(0.1 * size * vector())});
            const Mat3 M = to_matrix(shapes.particle_moment[i]);
            inertia.push_back(p.D * (M.trace() * Mat3::Identity() - M) * p.D.transpose());
        }
    }
    SweepInput input() const { return {rest, live, shapes, stiffness, inertia, held, span}; }
    std::vector<test::PlainGoal> plain_goals() const {
        std::vector<test::PlainGoal> plain(goals.size());
        for (size_t g = 0; g < plain.size(); ++g) plain[g].rotation = goals[g].rotation;
        test::plain_match(live, shapes, stiffness, h, particles, plain);
        return plain;
    }
};

class Sweep : public testing::TestWithParam<double> {};

TEST_P(Sweep, of_jacobi_is_that_of_the_plain_version) {
    Disorder d(GetParam());
    std::vector<MovingParticle> expected = d.particles;
    const auto goals = d.plain_goals();
    test::plain_average(d.live, d.shapes, goals, 1.5, d.held, expected);

    JacobiSweep sweep;
    sweep.apply(d.input(), 1.5, WorkerPool(1), d.goals, d.particles);
    // Single precision: 1e-7 of the piece's 1 m; rotations of a few groups are nearly undefined when all is random.
    const double bound = 1e-6 + 1e-5 * GetParam();
    for (size_t j = 0; j < expected.size(); ++j) {
        EXPECT_LE((d.particles[j].x - expected[j].x).norm(), bound) << j;
        EXPECT_LE(d.particles[j].d.angularDistance(expected[j].d), 10 * bound) << j;
        if (d.live.count(j) == 1) continue;
        EXPECT_LE(d.goals[j].rotation.angularDistance(goals[j].rotation), 10 * bound) << j;
    }
}

TEST_P(Sweep, of_newton_starts_from_the_rotations_of_the_plain_version) {
    Disorder d(GetParam());
    const auto goals = d.plain_goals();
    NewtonStep step;
    step.apply(true, d.input(), WorkerPool(1), d.goals, d.particles);
    for (size_t j = 0; j < goals.size(); ++j)
        if (d.live.count(j) > 1) {
            EXPECT_LE(d.goals[j].rotation.angularDistance(goals[j].rotation), 1e-7) << j;
        }
}

INSTANTIATE_TEST_SUITE_P(disorder, Sweep, testing::Values(0.01, 0.1, 0.5));

}  // namespace
}  // namespace sunder
