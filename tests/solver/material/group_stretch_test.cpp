#include "solver/material/group_stretch.h"

#include <gtest/gtest.h>

#include <random>

#include "solver/matching/groups_by_size.h"
#include "solver/matching/polar_decomposition.h"
#include "solver/scene/motion.h"
#include "tests/support/lattice_scene.h"
#include "tests/support/reference_stretch.h"

namespace sunder {
namespace {

using test::optimal_stretch;
using test::principal_stretch;

Mat3 stretch_of(const GroupStretches& s, size_t i) {
    return to_matrix({s.S[0][i], s.S[1][i], s.S[2][i], s.S[3][i], s.S[4][i], s.S[5][i]});
}

// A bar with flowed groups and broken edges, its particles out of place by `size` of its cells.
struct Bar {
    SimulationMesh rest = test::lattice_mesh({{4, 4, 12}, 0.05, 18, 1000, {Vec3(300, -200, 100), Quat::Identity()}});
    LiveTopology live;
    GroupShapes shapes;
    std::vector<MovingParticle> particles;
    std::vector<GroupGoal> goals;

    explicit Bar(double size) {
        build_one_rings(rest);
        std::mt19937_64 rng(5);
        std::uniform_real_distribution<double> uniform(-1, 1);
        const auto vector = [&] { return Vec3(uniform(rng), uniform(rng), uniform(rng)); };
        std::vector<uint8_t> intact(rest.n_edges(), 1);
        for (size_t e = 0; e < intact.size(); e += 4) intact[e] = 0;
        live.reset(rest, intact);
        std::vector<Mat3> plastic(rest.n_particles(), Mat3::Identity());
        for (size_t i = 0; i < plastic.size(); i += 3)  // neither diagonal nor symmetric
            plastic[i] = rotation_of(vector()) * Vec3(1.3, 1 / 1.3, 1).asDiagonal() * rotation_of(vector());
        shapes.reset(rest, live, plastic);
        for (const Vec3& x : rest.rest_position) {
            const Quat turn = rotation_of(size * vector());
            particles.push_back({x + 0.05 * size * vector(), turn, Vec3::Zero(), turn});
            goals.push_back({rotation_of(size * vector())});
        }
    }
    uint32_t n() const { return static_cast<uint32_t>(rest.n_particles()); }
    Mat3 rotated(uint32_t g) const {  // what the rotation is found of
        const GroupMoments A = group_moments(live, shapes, particles, g);
        return A.positions * to_matrix(shapes.group[g].isotropy) + kOrientationWeight * A.ellipsoids;
    }
    Mat3 stretch(uint32_t g, const Mat3& R) const {
        const GroupMoments A = group_moments(live, shapes, particles, g);
        return optimal_stretch(shapes.group[g].stretch, R, A.positions + kStretchMomentWeight * A.ellipsoids);
    }
};

// Groups of all sizes side by side; with the larger disorder a good part of them are turned inside out.
TEST(group_stretch, is_that_of_one_group) {
    for (const double size : {0.2, 2.0}) {
        const Bar bar(size);
        const GroupStretcher stretcher(bar.live, bar.shapes, bar.particles, bar.goals);
        size_t inverted = 0;
        for (uint32_t k = 0; k < bar.n(); ++k) {
            const uint32_t groups[4] = {k, bar.n() - 1 - k, k / 2, (7 * k) % bar.n()};
            GroupStretches found;
            stretcher.measure(groups, found);
            PrincipalLanes principal;
            stretcher.decompose(found, principal);
            for (size_t i = 0; i < 4; ++i) {
                const uint32_t g = groups[i];
                const Mat3 A = bar.rotated(g);
                inverted += A.determinant() < 0;
                const auto& q = found.rotation;
                const Mat3 R = Quat(q[3][i], q[0][i], q[1][i], q[2][i]).toRotationMatrix();
                const Mat3 expected = optimal_rotation(A, bar.goals[g].rotation).toRotationMatrix();
                // The score, since for some that are inverted several rotations score alike, but for rounding.
                ASSERT_NEAR((R.transpose() * A).trace(), (expected.transpose() * A).trace(), 1e-13 * A.norm()) << g;
                if (size < 1) {
                    ASSERT_LE((R - expected).norm(), 1e-12) << g;
                }  // rounding, and what Newton leaves
                const Mat3 S = bar.stretch(g, R);
                ASSERT_LE((stretch_of(found, i) - S).norm(), 1e-13 * (1 + S.norm())) << g;
                ASSERT_NEAR(found.deviation[i], (S - Mat3::Identity()).norm(), 1e-13 * (1 + S.norm())) << g;
                const PrincipalStretch p = principal_stretch(principal, i);
                const Mat3 composed = p.directions * p.stretch.asDiagonal() * p.directions.transpose();
                ASSERT_LE((composed - S).norm(), 1e-14 * (1 + S.norm())) << g;
                ASSERT_LE((p.directions.transpose() * p.directions - Mat3::Identity()).norm(), 1e-14) << g;
                // A rounding of |S| in eigenvalues of 0.1 or more.
                const Vec3 log_strain = principal_stretch(S).log_strain;
                ASSERT_LE((p.log_strain - log_strain).norm(), 1e-13 * (1 + S.norm())) << g;
                ASSERT_NEAR(largest_strain(principal, i), log_strain.cwiseAbs().maxCoeff(), 1e-13 * (1 + S.norm()))
                    << g;
            }
        }
        EXPECT_EQ(inverted > 100, size > 1) << inverted;
    }
}

// What flowed, lying as the flow put it, turned as a whole: the ellipsoids of its members hide no strain in it, however
// far it was drawn and whatever of it broke.
TEST(group_stretch, what_flowed_and_lies_as_it_flowed_is_not_strained) {
    Bar bar(0);
    const Quat turn = rotation_of(Vec3(0.4, -1.1, 0.7));
    std::vector<Mat3> plastic(bar.n());
    for (uint32_t g = 0; g < bar.n(); ++g) {
        const Mat3 F_P = Vec3(2.0, 0.8, 1 / 1.6).asDiagonal();
        plastic[g] = F_P;
        bar.shapes.rebuild(bar.rest, bar.live, plastic, g, g + 1, [](uint32_t) { return true; });
        for (uint32_t s = bar.live.begin(g); s < bar.live.end(g); ++s) {
            const uint32_t j = bar.live.member(s);
            bar.particles[j].x = turn * (F_P * (bar.rest.rest_position[j] - bar.rest.rest_position[g]));
            bar.particles[j].d = turn;
        }
        bar.goals[g].rotation = rotation_of(Vec3(0.3, -1.0, 0.6));
        GroupStretches found;
        GroupStretcher(bar.live, bar.shapes, bar.particles, bar.goals).measure({g, g, g, g}, found);
        // Roundings of A_pq over the least of A_qq, which in flat and torn groups are the ellipsoids.
        ASSERT_LE(found.deviation[0], 1e-12) << g;
        ASSERT_NEAR(
            std::abs(
                Quat(found.rotation[3][0], found.rotation[0][0], found.rotation[1][0], found.rotation[2][0]).dot(turn)),
            1, 1e-14)
            << g;
    }
}

TEST(group_stretch, has_the_same_bits_with_every_instruction_set) {
    const Bar bar(0.6);
    const auto all = [&](const char* instructions) {
        setenv("SUNDER_INSTRUCTIONS", instructions, 1);
        const GroupStretcher stretcher(bar.live, bar.shapes, bar.particles, bar.goals);
        unsetenv("SUNDER_INSTRUCTIONS");
        std::vector<double> numbers;
        for (uint32_t g = 0; g < bar.n(); ++g) {
            GroupStretches found;
            stretcher.measure({g, bar.n() - 1 - g, 0, g}, found);
            numbers.insert(numbers.end(), found.rotation[0], found.rotation[0] + sizeof found / sizeof(double));
            PrincipalLanes principal;
            stretcher.decompose(found, principal);
            numbers.insert(numbers.end(), principal.stretch[0],
                           principal.stretch[0] + sizeof principal / sizeof(double));
        }
        return numbers;
    };
    EXPECT_EQ(hash_of(all("portable")), hash_of(all("avx2")));
    EXPECT_EQ(hash_of(all("portable")), hash_of(all("")));
}

TEST(groups_by_size, each_group_comes_once_with_others_of_its_size) {
    GroupsBySize waiting;
    std::vector<int> seen(203, 0);
    const auto size_of = [](uint32_t g) { return 2 + g * g % 40; };
    bool finishing = false;
    const auto four = [&](const uint32_t(&groups)[4], uint32_t n) {
        for (uint32_t i = 0; i < n; ++i) ++seen[groups[i]];
        for (uint32_t i = n; i < 4; ++i) EXPECT_LT(groups[i], seen.size());
        if (finishing) return;
        EXPECT_EQ(n, 4u);
        const auto bounded = [&](uint32_t i) { return std::min(size_of(groups[i]), 31u); };
        for (uint32_t i = 1; i < 4; ++i) EXPECT_EQ(bounded(i), bounded(0));
    };
    for (uint32_t g = 0; g < seen.size(); ++g) waiting.add(g, size_of(g), four);
    finishing = true;
    waiting.finish(four);
    EXPECT_EQ(std::ranges::count(seen, 1), static_cast<std::ptrdiff_t>(seen.size()));
}

}  // namespace
}  // namespace sunder
