#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "solver/data/frame_state.h"
#include "solver/matching/group_shape.h"
#include "solver/scene/motion.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

// A bar, far from the origin, with flowed groups, broken edges, flat and thin rings, a pair and a loose particle.
struct Bar {
    SimulationMesh rest = test::lattice_mesh({{4, 4, 12}, 0.05, 18, 1000, {Vec3(300, -200, 100), Quat::Identity()}});
    LiveTopology live;
    std::vector<Mat3> plastic;

    Bar() {
        build_one_rings(rest);
        std::vector<uint8_t> intact(rest.n_edges(), 1);
        const auto plane = [&](uint32_t i, int axis) { return std::lround(rest.rest_position[i][axis] / 0.05); };
        for (size_t e = 0; e < intact.size(); ++e) {
            const auto [a, b] = std::pair(rest.edges[e].a, rest.edges[e].b);
            const bool is_upper = std::max(plane(a, 2), plane(b, 2)) > plane(0, 2) + 7;
            const bool is_lowest = plane(a, 2) == plane(0, 2) || plane(b, 2) == plane(0, 2);
            intact[e] = is_upper ? plane(a, 2) == plane(b, 2) : is_lowest ? a == 0 && b == 1 : e % 4 != 0;
        }
        live.reset(rest, intact);
        plastic.assign(rest.n_particles(), Mat3::Identity());
        for (size_t i = 0; i < plastic.size(); i += 3) {
            const Mat3 turn = rotation_of(Vec3(0.1 * static_cast<double>(i), 0.3, -0.2)).toRotationMatrix();
            plastic[i] = turn * Vec3(1.3, 1 / 1.3, 1).asDiagonal() * turn.transpose();
        }
    }
    uint32_t n() const { return static_cast<uint32_t>(rest.n_particles()); }
    GroupShapes shapes() const {
        GroupShapes made;
        made.reset(rest, live, plastic);
        return made;
    }
};

uint64_t bits(const GroupShapes& shapes) {
    std::vector<double> numbers;
    const auto add = [&](const auto& records) {
        const auto* first = reinterpret_cast<const double*>(records.data());
        numbers.insert(numbers.end(), first, first + records.size() * sizeof(records[0]) / sizeof(double));
    };
    add(shapes.group), add(shapes.member);
    return hash_of(numbers);
}

// From the definitions in group_shape.h, by another eigen-decomposition.
TEST(rest_shape, is_what_its_definition_says) {
    const Bar bar;
    const GroupShapes shapes = bar.shapes();
    size_t lone = 0, flat = 0, thin = 0, balanced = 0;
    for (uint32_t g = 0; g < bar.n(); ++g) {
        const GroupShape& shape = shapes.group[g];
        Vec3 center = Vec3::Zero();
        double mass = 0;
        for (uint32_t s = bar.live.begin(g); s < bar.live.end(g); ++s) {
            const double m = shapes.member_mass(bar.live, s);
            mass += m, center += m * (bar.rest.rest_position[bar.live.member(s)] - bar.rest.rest_position[g]);
        }
        center /= mass;
        ASSERT_NEAR(shape.mass, mass, 1e-14 * mass);
        Mat3 A = Mat3::Zero(), M = Mat3::Zero();
        for (uint32_t s = bar.live.begin(g); s < bar.live.end(g); ++s) {
            const Vec3 x = bar.rest.rest_position[bar.live.member(s)] - bar.rest.rest_position[g] - center;
            const Vec3 q = bar.plastic[g] * x;
            ASSERT_LE((shapes.member[s].q - q).norm(), 1e-15) << g;
            A += shapes.member_mass(bar.live, s) * q * q.transpose();
            M += to_matrix(shapes.member_moment(bar.live, s));
        }
        const Mat3 A_qq = A + kStretchMomentWeight * M;
        const double size = A_qq.norm();
        const Mat3& V = shape.stretch.V;
        ASSERT_LE((V.transpose() * V - Mat3::Identity()).norm(), 1e-14) << g;
        const Vec3 a(1 / shape.stretch.Lam[0], 1 / shape.stretch.Lam[1], 1 / shape.stretch.Lam[2]);
        ASSERT_LE((V * a.asDiagonal() * V.transpose() - A_qq).norm(), 1e-14 * size) << g;
        ASSERT_NEAR(shape.stretch.Lam[4] * 0.5 * (a(0) + a(2)), 1, 1e-14);
        ASSERT_NEAR(shape.positions_trace, A.trace(), 1e-14 * size) << g;

        // Below, 1e-9: what is inverted is 1e-6 of the largest eigenvalue or more, known to 1e-10 of itself.
        const Eigen::SelfAdjointEigenSolver<Mat3> eigen(A);
        const Vec3& e = eigen.eigenvalues();
        const Mat3& E = eigen.eigenvectors();
        const double mean = e.sum() / 3;
        Vec3 ratio = Vec3::Ones(), affine = Vec3::Zero();
        for (int i = 0; i < 3; ++i)
            if (e(i) > 1e-6 * e(2)) {
                ratio(i) = mean / std::max(e(i), 0.25 * e(2)), affine(i) = (1 - ratio(i)) / e(i);
                thin += e(i) < 0.25 * e(2);
            } else
                flat += e(2) > 0;
        lone += bar.live.count(g) == 1, balanced += ratio.maxCoeff() > 1.1;
        const auto along = [&](const Vec3& d) -> Mat3 { return E * d.asDiagonal() * E.transpose(); };
        const auto expect_near = [&](const Sym3& found, const Mat3& expected) {
            ASSERT_LE((to_matrix(found) - expected).norm(), 1e-9 * expected.norm()) << g;
        };
        expect_near(shape.isotropy, along(ratio));
        ASSERT_LE((to_matrix(shape.N) - along(affine)).norm() * size, 1e-9) << g;
        ASSERT_LE((to_matrix(shape.stiffness_moment) - along(ratio.cwiseProduct(e))).norm(), 1e-12 * size) << g;
        ASSERT_NEAR(shape.most_isotropy, std::max(1.0, ratio.maxCoeff()), 1e-9) << g;

        const Mat3 W = V * a.cwiseMax(0.25 * a.maxCoeff()).cwiseInverse().asDiagonal() * V.transpose();
        expect_near(shape.volume_gradient, W);
        ASSERT_NEAR(shape.volume_rest, (A * W).trace(), 1e-13) << g;
        ASSERT_NEAR(shape.most_pressure, A.trace() / std::sqrt(3.0) * W.norm(), 1e-12) << g;
        ASSERT_EQ(shape.plastic_key, plastic_key(bar.plastic[g]));
    }
    EXPECT_GT(lone, 10u);
    EXPECT_GT(flat, 10u);
    EXPECT_GT(thin, 10u);
    EXPECT_GT(balanced, 10u);
}

// Points have no moments of their own: A_qq is singular where a group is flat, and 0 where it is a particle alone.
TEST(rest_shape, of_points_is_finite_and_bounded) {
    Bar bar;
    for (Vec3& radii : bar.rest.radii) radii.setZero();
    const GroupShapes shapes = bar.shapes();
    size_t lone = 0, singular = 0;
    for (uint32_t g = 0; g < bar.n(); ++g) {
        const GroupShape& shape = shapes.group[g];
        for (const double* number = &shape.mass; number <= &shape.most_pressure; ++number)
            ASSERT_TRUE(std::isfinite(*number)) << g;
        const Sym3& Lam = shape.stretch.Lam;  // 1 / a of the directions
        const double thickest = 1 / std::min({Lam[0], Lam[1], Lam[2]}),
                     thinnest = 1 / std::max({Lam[0], Lam[1], Lam[2]});
        ASSERT_GE(thinnest, 1e-9 * thickest * (1 - 1e-14)) << g;
        lone += bar.live.count(g) == 1, singular += bar.live.count(g) > 1 && thinnest < 2e-9 * thickest;
        if (bar.live.count(g) == 1) {
            ASSERT_EQ(shape.most_pressure, 0) << g;
        }
    }
    EXPECT_GT(lone, 10u);
    EXPECT_GT(singular, 10u);
}

// A shot that goes on from a file has the bits of one that never stopped: which groups are built at a time differs.
TEST(rest_shape, has_the_same_bits_alone_and_beside_any_others) {
    const Bar bar;
    const GroupShapes together = bar.shapes();
    GroupShapes alone = together;
    for (MemberShape& m : alone.member) m.q.setConstant(7);
    for (GroupShape& shape : alone.group) shape = GroupShape();
    for (uint32_t g = 0; g < bar.n(); ++g)
        alone.rebuild(bar.rest, bar.live, bar.plastic, g, g + 1, [](uint32_t) { return true; });
    // Slots of edges that broke before are nobody's.
    for (uint32_t g = 0; g < bar.n(); ++g)
        for (uint32_t s = bar.live.end(g); s < (g + 1 < bar.n() ? bar.live.begin(g + 1) : bar.live.n_slots()); ++s)
            alone.member[s] = together.member[s];
    EXPECT_EQ(bits(alone), bits(together));
}

TEST(rest_shape, has_the_same_bits_with_every_instruction_set) {
    const Bar bar;
    const auto made_by = [&](const char* instructions) {
        setenv("SUNDER_INSTRUCTIONS", instructions, 1);
        const GroupShapes shapes = bar.shapes();
        unsetenv("SUNDER_INSTRUCTIONS");
        return bits(shapes);
    };
    EXPECT_EQ(made_by("portable"), made_by("avx2"));
    EXPECT_EQ(made_by("portable"), made_by(""));
}

}  // namespace
}  // namespace sunder
