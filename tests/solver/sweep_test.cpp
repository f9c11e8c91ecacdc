#include <gtest/gtest.h>

#include <random>

#include "solver/lanes/instruction_set.h"
#include "solver/matching/jacobi_sweep.h"
#include "solver/matching/newton_step.h"
#include "solver/matching/step_limit.h"
#include "solver/scene/motion.h"
#include "tests/support/lattice_scene.h"
#include "tests/support/plain_sweep.h"

namespace sunder {
namespace {

// A bar far from the origin, with flowed groups, broken edges, a held particle and everything out of place.
struct Disorder {
    SimulationMesh rest = test::lattice_mesh({{4, 4, 20}, 0.05, 6, 1000, {Vec3(300, -200, 100), Quat::Identity()}});
    std::vector<uint8_t> intact;
    std::vector<Mat3> plastic;
    LiveTopology live;
    GroupShapes shapes;
    std::vector<GroupStiffness> stiffness;
    std::vector<Role> role;
    std::vector<MovingParticle> particles;
    std::vector<GroupGoal> goals;
    const double h = 1.0 / 192;
    std::vector<double> span;
    std::vector<uint8_t> touched;  // all of it

    explicit Disorder(double size) {
        build_one_rings(rest);
        const size_t n = rest.n_particles();
        std::mt19937_64 rng(3);
        std::uniform_real_distribution<double> uniform(-1, 1);
        const auto vector = [&] { return Vec3(uniform(rng), uniform(rng), uniform(rng)); };
        intact.assign(rest.n_edges(), 1);
        for (size_t e = 0; e < intact.size(); e += 5) intact[e] = 0;
        live.reset(rest, intact);
        plastic.assign(n, Mat3::Identity());
        for (size_t i = 0; i < n; i += 3) plastic[i].diagonal() = Vec3(1.2, 1 / 1.2, 1);
        shapes.reset(rest, live, plastic);
        Material material;
        material.youngs_modulus = 2e6, material.poisson_ratio = 0.3;
        role.assign(n, Role::free), role[7] = Role::held;
        span.assign(n, h);
        touched.assign(live.n_pieces(), 1);
        for (uint32_t i = 0; i < n; ++i) {
            stiffness.push_back(group_stiffness(shapes.group[i], shapes.rest_trace[i], rest.volume[i], material));
            MovingParticle p;
            p.x = rest.rest_position[i] + 0.05 * size * vector();
            p.x_inertial = p.x + 0.01 * size * vector();
            p.d = rotation_of(size * vector()), p.d_inertial = rotation_of(size * vector());
            particles.push_back(p);
            goals.push_back({rotation_of(0.1 * size * vector())});
        }
    }
    // The same bar over and over, in the same place.
    void repeat(int times) {
        const SimulationMesh bar = rest;
        const auto copies = [&](auto& io_array) {
            const auto once = io_array;
            for (int k = 1; k < times; ++k) io_array.insert(io_array.end(), once.begin(), once.end());
        };
        for (int k = 1; k < times; ++k) append_body(rest, bar, Pose{});
        build_one_rings(rest);
        copies(intact), copies(plastic), copies(stiffness), copies(role), copies(particles);
        copies(goals), copies(span);
        live.reset(rest, intact);
        shapes.reset(rest, live, plastic);
    }
    JacobiIteration one_of(int sweeps, int number) const { return {number, sweeps, 1.5, touched}; }
    SweepInput input() const { return {rest, live, shapes, stiffness, role, span}; }
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
    test::plain_average(d.live, d.shapes, goals, 1.5, d.role, expected);

    JacobiSweep sweep;
    sweep.apply(d.one_of(1, 0), d.input(), WorkerPool(1), d.goals, d.particles);
    // Single precision: 1e-7 of the piece's 1 m; rotations of a few groups are nearly undefined when all is random.
    const double bound = 1e-6 + 1e-5 * GetParam();
    for (size_t j = 0; j < expected.size(); ++j) {
        EXPECT_LE((d.particles[j].x - expected[j].x).norm(), bound) << j;
        EXPECT_LE(d.particles[j].d.angularDistance(expected[j].d), 10 * bound) << j;
        if (d.live.count(j) == 1) continue;
        EXPECT_LE(d.goals[j].rotation.angularDistance(goals[j].rotation), 10 * bound) << j;
    }
}

TEST_P(Sweep, of_jacobi_goes_on_as_if_it_began_there) {
    Disorder d(GetParam());
    JacobiSweep sweep, other;
    sweep.apply(d.one_of(2, 0), d.input(), WorkerPool(1), d.goals, d.particles);
    for (MovingParticle& p : d.particles)
        p.x += Vec3(0.001, 0, 0), p.x_inertial += Vec3(0, 0.001, 0);  // as contacts do
    Disorder anew = d;
    sweep.apply(d.one_of(2, 1), d.input(), WorkerPool(1), d.goals, d.particles);
    other.apply(anew.one_of(1, 0), anew.input(), WorkerPool(1), anew.goals, anew.particles);
    for (size_t j = 0; j < d.particles.size(); ++j) {
        EXPECT_EQ(d.particles[j].x, anew.particles[j].x) << j;
        EXPECT_EQ(d.particles[j].d.coeffs(), anew.particles[j].d.coeffs()) << j;
        EXPECT_EQ(d.goals[j].rotation.coeffs(), anew.goals[j].rotation.coeffs()) << j;
    }
}

// What nothing pushes between sweeps stays in single precision: 6e-8 of the piece's 1 m a sweep, and what later sweeps
// make of it, over rotations that are nearly undefined where all is random.
TEST_P(Sweep, of_jacobi_are_made_at_once_where_nothing_pushes_between_them) {
    Disorder one_by_one(GetParam()), at_once = one_by_one;
    JacobiSweep sweep, other;
    for (int k = 0; k < 4; ++k) {
        sweep.apply(one_by_one.one_of(4, k), one_by_one.input(), WorkerPool(1), one_by_one.goals, one_by_one.particles);
        at_once.touched.assign(at_once.touched.size(), 0);
        other.apply(at_once.one_of(4, k), at_once.input(), WorkerPool(1), at_once.goals, at_once.particles);
    }
    const double bound = 1e-6 + 1e-5 * GetParam();
    for (size_t j = 0; j < one_by_one.particles.size(); ++j) {
        const MovingParticle &p = one_by_one.particles[j], &q = at_once.particles[j];
        EXPECT_LE((p.x - q.x).norm(), bound) << j;
        EXPECT_LE(p.d.angularDistance(q.d), 10 * bound) << j;
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

TEST(sweep, of_newton_turns_no_particle_by_more_than_it_may) {
    Disorder d(0.5);
    const auto before = d.particles;
    NewtonStep step;
    step.apply(true, d.input(), WorkerPool(1), d.goals, d.particles);
    double most = 0;
    for (size_t j = 0; j < before.size(); ++j) most = std::max(most, d.particles[j].d.angularDistance(before[j].d));
    EXPECT_NEAR(most, StepLimit::kMostTurn, 1e-9);
}

TEST(sweep, of_newton_is_shortened_as_the_particle_asks_that_turns_most) {
    StepLimit limit;
    const auto turn = [&](uint32_t piece, double by) {  // rad
        EXPECT_EQ(StepLimit::may_be_far(std::cos(by / 2)), by > StepLimit::kMostTurn) << by;
        limit.add(PieceId(piece), std::cos(by / 2));
    };
    turn(1, 0.4), turn(1, 1.2), turn(1, 0.1), turn(2, 0.25), turn(4, 0.32);
    EXPECT_NEAR(limit.share(PieceId(1)), 0.3 / 1.2, 1e-12);
    EXPECT_NEAR(limit.share(PieceId(4)), 0.3 / 0.32, 1e-12);
    EXPECT_EQ(limit.share(PieceId(2)), 1);
    EXPECT_EQ(limit.share(PieceId(3)), 1);
}

// What a turn of a group meets, K = tr(A) I - A + omega sum w H with A = R S R^T, of ellipsoids of three different
// radii.
TEST(sweep, of_newton_takes_the_inertia_of_members_as_they_are_turned) {
    Disorder d(0.5);
    std::mt19937_64 rng(7);
    std::uniform_real_distribution<double> uniform(0.3, 1);
    for (size_t i = 0; i < d.rest.n_particles(); ++i) {
        d.rest.radii[i] = 0.2 * Vec3(uniform(rng), uniform(rng), uniform(rng));  // large, so that they count
        d.rest.rest_orientation[i] = rotation_of(Vec3(uniform(rng), -uniform(rng), uniform(rng)));
    }
    d.shapes.reset(d.rest, d.live, d.plastic);
    LaneLayout layout;
    layout.update(d.live, WorkerPool(1));
    const SweepKernels& kernels = SUNDER_BEST_KERNELS(kSweepKernels);
    for (size_t u = 0; u < layout.units().size(); ++u) {
        const size_t n = layout.units()[u].n_blocks(), n_lanes = LaneLayout::kLanes * n;
        const UnitBlocks blocks(n, nullptr);
        SweepStore<double> store;
        store.open(d.input(), layout, u, blocks);
        store.take_up(d.input(), kernels, 0, n);
        store.load(d.input(), d.goals, 0, n);
        std::vector<NewtonParticles> particles(n);
        std::vector<EllipsoidRecord> ellipsoids(n_lanes);
        std::vector<CgGroups<double>> groups(n);
        const NewtonRecords records{moving_records(std::span(std::as_const(d.particles))),
                                    d.shapes.particle_moment.data()->data(),
                                    d.rest.mass.data(),
                                    d.role.data(),
                                    nullptr,
                                    nullptr,
                                    store.lane_particles()};
        kernels.take_in_for_newton(records, particles.data(), store.particles(), ellipsoids.data(), 0, n);
        SweepArrays<double> arrays = store.arrays();
        arrays.ellipsoids = ellipsoids.data(), arrays.newton = nullptr, arrays.newton_full = groups.data();
        kernels.match_for_newton(arrays, 0, n);
        store.give_rotations(d.goals, 0, n);
        for (size_t lane = 0; lane < n_lanes; ++lane) {
            const uint32_t g = store.lane_particles()[lane];
            if (g == kNone) continue;
            const Mat3 R = d.goals[g].rotation.toRotationMatrix();
            const Mat3 A = R * to_matrix(d.shapes.group[g].stiffness_moment) * R.transpose();
            Mat3 K = A.trace() * Mat3::Identity() - A;
            for (uint32_t s = d.live.begin(g); s < d.live.end(g); ++s) {
                const uint32_t j = d.live.member(s);
                const Mat3 D = d.particles[j].d.toRotationMatrix(), M = to_matrix(d.shapes.particle_moment[j]);
                const Mat3 H = D * (M.trace() * Mat3::Identity() - M) * D.transpose();
                K += kOrientationWeight * d.shapes.member[s].weight * H;
            }
            Sym3 inverse;
            for (size_t i = 0; i < 6; ++i) inverse[i] = groups[lane / 8].K_inverse[i][lane % 8];
            // Roundings of K, as much larger in its inverse as its axes differ: ten times at most.
            ASSERT_LE((to_matrix(inverse) * K - Mat3::Identity()).norm(), 1e-12) << g;
        }
    }
}

// What is braced stays, the more the harder; and where nothing is left to do is where it is without.
TEST(sweep, of_newton_keeps_what_is_braced_from_going_too_far_and_not_from_arriving) {
    const Disorder start(0.01);
    const uint32_t tip = 0;
    const auto steps = [&](double brace, int n) {
        Disorder d = start;
        std::vector<double> braces(d.particles.size(), 0.0);
        braces[tip] = brace;
        SweepInput input = d.input();
        input.brace = braces;
        NewtonStep newton;
        for (int k = 0; k < n; ++k) newton.apply(true, input, WorkerPool(1), d.goals, d.particles);
        return d.particles;
    };
    const auto way = [&](const std::vector<MovingParticle>& to) { return (to[tip].x - start.particles[tip].x).norm(); };
    const double free = way(steps(0, 1)), braced = way(steps(100, 1)), fixed = way(steps(1e9, 1));
    EXPECT_LT(braced, free);
    EXPECT_LT(fixed, 1e-6 * free);  // its own entry is some hundred masses at most
    // The matrix is no less than the masses: with a brace of 20 a step leaves at most 20/21 of the way, 300 of them
    // 4e-7. What is below 1e-8 m is no longer seen.
    const std::vector<MovingParticle> expected = steps(0, 20), arrived = steps(20, 300);
    for (size_t j = 0; j < expected.size(); ++j)
        EXPECT_LE((arrived[j].x - expected[j].x).norm(), 1e-5 * free) << "particle " << j;
}

// Thirty bars, all as out of place as one: so many that their rest shapes are expanded when they are needed.
TEST(sweep, of_newton_is_the_same_whether_rest_shapes_stay_expanded_or_not) {
    const Disorder one(0.1);
    NewtonStep alone;
    Disorder expected = one;
    alone.apply(true, expected.input(), WorkerPool(1), expected.goals, expected.particles);
    for (const int threads : {1, 3}) {
        Disorder many = one;
        many.repeat(30);
        NewtonStep together;
        // Twice: the second time every store holds another unit, whose shapes are of the same revisions.
        for (int k = 0; k < 2; ++k) {
            Disorder d = many;
            together.apply(true, d.input(), WorkerPool(threads), d.goals, d.particles);
            const size_t n = one.particles.size();
            for (size_t j = 0; j < d.particles.size(); ++j) {
                ASSERT_EQ(d.particles[j].x, expected.particles[j % n].x) << j;
                ASSERT_EQ(d.particles[j].d.coeffs(), expected.particles[j % n].d.coeffs()) << j;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(disorder, Sweep, testing::Values(0.01, 0.1, 0.5));

}  // namespace
}  // namespace sunder
