#include "solver/pieces/momentum.h"

#include <gtest/gtest.h>

#include <random>

#include "solver/scene/motion.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

struct Moving {
    SimulationMesh rest = test::lattice_mesh({{3, 2, 4}, 0.1, 6, 1000, {Vec3(100, -50, 20), Quat::Identity()}});
    std::vector<Sym3> inertia = std::vector<Sym3>(rest.n_particles(), {1e-3, 2e-3, 2.5e-3, 3e-4, -5e-4, 7e-4});
    std::vector<Vec3> x = rest.rest_position, v = x, w = x;
    std::vector<ParticleId> all;
    Moving() {
        std::mt19937_64 rng(7);
        std::normal_distribution<double> normal;
        for (ParticleId i(0); i < x.size(); ++i) {
            all.push_back(i);
            x[i] += Vec3(100, 0, 0);
            v[i] = Vec3(normal(rng), normal(rng), normal(rng));
            w[i] = Vec3(normal(rng), normal(rng), normal(rng));
        }
    }
};

TEST(momentum, any_angular_momentum_can_be_set_exactly_without_touching_the_linear_one) {
    Moving m;
    const Vec3 wanted(0.3, -2, 1);
    const Vec3 velocity = piece_momentum(m.rest, m.inertia, m.all, m.x, m.v, m.w).velocity;
    set_angular_momentum(m.rest, m.inertia, m.all, wanted, 1e300, m.x, m.v, m.w);
    const PieceMomentum after = piece_momentum(m.rest, m.inertia, m.all, m.x, m.v, m.w);
    EXPECT_LE((after.angular - wanted).norm(), 1e-10);
    EXPECT_LE((after.velocity - velocity).norm(), 1e-12);
}

// Jelly at two substeps on which a blade went off at 18 times the blade's speed: fragments that spin by more than half
// a turn in a substep seem to spin the other way, and all of their piece made up for that.
TEST(momentum, a_spin_that_would_give_more_energy_than_there_is_stops_at_that) {
    const auto spun = [](const Moving& m, const Vec3& wanted, double most) {
        Moving after = m;
        set_angular_momentum(m.rest, m.inertia, m.all, wanted, most, m.x, after.v, after.w);
        return piece_momentum(m.rest, m.inertia, m.all, m.x, after.v, after.w);
    };
    const auto energy = [](const PieceMomentum& p) { return 0.5 * p.angular.dot(rigid_spin(p, p.angular)); };
    const Moving m;
    const PieceMomentum before = piece_momentum(m.rest, m.inertia, m.all, m.x, m.v, m.w);
    const Vec3 wanted(30, -200, 100);
    const double all = energy(spun(m, wanted, 1e300)), now = energy(before);
    ASSERT_GT(all, 10 * now);
    EXPECT_NEAR(energy(spun(m, wanted, 0.3 * all)), 0.3 * all, 1e-9 * all);
    EXPECT_LE((spun(m, wanted, 1.01 * all).angular - wanted).norm(), 1e-8);
    EXPECT_LE(energy(spun(m, wanted, 0)), now * (1 + 1e-9));
    EXPECT_LE((spun(m, 0.5 * before.angular, 0).angular - 0.5 * before.angular).norm(), 1e-9);  // less is always right
    EXPECT_LE((spun(m, before.angular, 0).angular - before.angular).norm(), 1e-9);
}

TEST(momentum, a_rigid_spin_has_the_inertia_of_the_whole) {
    Moving m;
    const Vec3 spin(0, 0, 2);
    const Vec3 center = piece_momentum(m.rest, m.inertia, m.all, m.x, m.v, m.w).center;
    for (const ParticleId i : m.all) m.v[i] = Vec3(1, 2, 3) + spin.cross(m.x[i] - center), m.w[i] = spin;
    const PieceMomentum p = piece_momentum(m.rest, m.inertia, m.all, m.x, m.v, m.w);
    EXPECT_LE((p.angular - p.inertia * spin).norm(), 1e-10 * p.angular.norm());
}

// The axes of the moment turn with the ellipsoid; about one of them the others resist.
TEST(momentum, an_ellipsoid_that_is_turned_resists_about_its_own_axes) {
    const Quat turn = rotation_of(Vec3(0.4, -1.3, 0.8));
    const Sym3 H = turned_inertia(turn, {1, 2, 4, 0, 0, 0});
    for (int i = 0; i < 3; ++i) {
        const Vec3 axis = turn * Vec3::Unit(i);
        EXPECT_LE((product(H, axis) - Vec3(6, 5, 3)(i) * axis).norm(), 1e-14);
    }
}

TEST(momentum, a_point_without_inertia_stays_finite) {
    Moving m;
    for (Sym3& h : m.inertia) h = {};
    const std::vector<ParticleId> one = {ParticleId(0)};
    set_angular_momentum(m.rest, m.inertia, one, Vec3(1, 0, 0), 1e300, m.x, m.v, m.w);
    EXPECT_TRUE(m.v[0].allFinite() && m.w[0].allFinite());
}

}  // namespace
}  // namespace sunder
