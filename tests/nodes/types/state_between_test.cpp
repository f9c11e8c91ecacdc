// What is shown between two kept states: motions that can be worked out by hand.
#include "nodes/types/state_between.h"

#include <gtest/gtest.h>

#include "solver/data/rotations.h"
#include "solver/scene/motion.h"

namespace sunder {
namespace {

constexpr double kFrame = 1.0 / 24;  // s

/// Particles in a row, each joined to the next.
SimulationMesh row(size_t n) {
    SimulationMesh rest;
    for (size_t i = 0; i < n; ++i) {
        rest.rest_position.push_back(Vec3(static_cast<double>(i), 0, 0));
        rest.rest_orientation.push_back(Quat::Identity());
        rest.mass.push_back(1 + static_cast<double>(i));
        if (i > 0)
            rest.edges.push_back({ParticleId(static_cast<uint32_t>(i - 1)), ParticleId(static_cast<uint32_t>(i))});
    }
    return rest;
}

/// The row where a rigid motion about its centre of mass has it.
FrameState placed(const SimulationMesh& rest, const Vec3& centre, const Quat& turn, const Vec3& velocity,
                  const Vec3& spin) {
    FrameState s;
    Vec3 middle = Vec3::Zero();
    double mass = 0;
    for (size_t i = 0; i < rest.n_particles(); ++i)
        middle += rest.mass[i] * rest.rest_position[i], mass += rest.mass[i];
    for (const Vec3& x : rest.rest_position) {
        const Vec3 arm = turn * Vec3(x - middle / mass);
        s.position.push_back(centre + arm);
        s.velocity.push_back(velocity + spin.cross(arm));
    }
    const size_t n = rest.n_particles();
    s.orientation.assign(n, turn), s.group_rotation.assign(n, turn), s.angular_velocity.assign(n, spin);
    s.plastic_deformation.assign(n, Mat3::Identity());
    s.yield.assign(n, INFINITY), s.strain.assign(n, 0);
    s.edge_intact.assign(rest.n_edges(), 1);
    return s;
}

double farthest(const FrameState& a, const FrameState& b) {
    double most = 0;
    for (size_t i = 0; i < a.n_particles(); ++i) {
        most = std::max(most, (a.position[i] - b.position[i]).norm());
        most = std::max(most, angle_between(a.orientation[i], b.orientation[i]));
        most = std::max(most, kFrame * (a.velocity[i] - b.velocity[i]).norm());
        most = std::max(most, kFrame * (a.angular_velocity[i] - b.angular_velocity[i]).norm());
    }
    return most;
}

TEST(StateBetween, a_free_flight_with_any_spin_is_what_it_is) {
    const SimulationMesh rest = row(5);
    const Vec3 gravity(0, 0, -9.81), start(1, 2, 3), velocity(2, 0, 4), axis = Vec3(1, 2, -2) / 3;
    for (const double turns : {0.0, 0.1, 0.49, 0.51, 0.9, 1.0, 3.3}) {
        const Vec3 spin = axis * (turns * 2 * M_PI / kFrame);
        const auto at = [&](double t) {
            FrameState s = placed(rest, start + t * velocity + 0.5 * t * t * gravity, rotation_of(t * spin),
                                  velocity + t * gravity, spin);
            s.time = 10 + t;
            return s;
        };
        for (const double share : {0.1, 0.5, 0.99})
            EXPECT_LT(farthest(state_between(rest, at(0), at(kFrame), share), at(share * kFrame)), 1e-12) << turns;
    }
}

TEST(StateBetween, what_is_let_go_on_the_way_tells_when_and_stays_what_it_was) {
    const SimulationMesh rest = row(2);
    FrameState a = placed(rest, Vec3::Zero(), Quat::Identity(), Vec3::Zero(), Vec3::Zero()), b = a;
    b.time = kFrame;
    a.inactive.assign(2, {.what = Inactivity::kHeld});
    b.inactive = {{.what = 0, .followed = 0.3 * kFrame}, a.inactive[1]};
    for (const double share : {0.1, 0.9}) {
        const FrameState between = state_between(rest, a, b, share);
        EXPECT_EQ(between.inactive[0].followed, 0.3 * kFrame);
        EXPECT_EQ(between.inactive[1], a.inactive[1]);
        EXPECT_EQ(between.inactive[0].what, Inactivity::kHeld);
    }
}

// A state of a file may be of a scene that kept nothing.
TEST(StateBetween, what_one_end_alone_keeps_is_as_at_the_beginning) {
    const SimulationMesh rest = row(2);
    FrameState plain = placed(rest, Vec3::Zero(), Quat::Identity(), Vec3::Zero(), Vec3::Zero()), keeps = plain;
    keeps.inactive.assign(2, {.what = Inactivity::kHeld, .followed = 0});
    keeps.edge_damage = {0.2}, keeps.edge_hold = {0.9}, keeps.stiffness_factor = {1, 1};
    keeps.plastic_curvature.assign(2, Mat3::Identity()), keeps.layer_strain.resize(2), keeps.edge_offset.resize(1);
    keeps.edge_intact = {0}, keeps.broken = {{EdgeId(0), 0.25 * kFrame, 0.1}};
    FrameState end = keeps;
    end.time = kFrame;
    const FrameState between = state_between(rest, plain, end, 0.5);
    EXPECT_TRUE(between.inactive.empty() && between.edge_damage.empty() && between.plastic_curvature.empty());
    EXPECT_EQ(between.edge_intact[0], 0);
    EXPECT_EQ(piece_motions(rest, plain, end, between).size(), 2u);
}

TEST(StateBetween, what_lands_does_not_dip_below_where_it_lands) {
    const SimulationMesh rest = row(1);
    FrameState a = placed(rest, Vec3(0, 0, 0.01), Quat::Identity(), Vec3(0, 0, -5), Vec3::Zero());
    FrameState b = placed(rest, Vec3::Zero(), Quat::Identity(), Vec3::Zero(), Vec3::Zero());
    b.time = kFrame;
    for (const double share : {0.1, 0.5, 0.9}) EXPECT_GE(state_between(rest, a, b, share).position[0].z(), 0);
}

// A plank that sags from where it is clamped, and one whose clamp moves: its other end falls as far as in free flight.
TEST(StateBetween, what_is_held_goes_its_own_way_and_its_piece_along) {
    const SimulationMesh rest = row(4);
    for (const double speed : {0.0, 2.0}) {
        const auto at = [&](double t) {
            FrameState s = placed(rest, Vec3(2, 0, 0), Quat::Identity(), Vec3::Zero(), Vec3::Zero());
            for (size_t i = 0; i < 4; ++i) {
                const double bends = 0.5 * static_cast<double>(i * i);
                s.velocity[i] = Vec3(speed, 0, -9.81 * t * bends);
                s.position[i] += Vec3(speed * t, 0, -0.5 * 9.81 * t * t * bends);
            }
            s.time = t;
            return s;
        };
        const FrameState a = at(kFrame), b = at(2 * kFrame);
        for (const double share : {0.1, 0.5, 0.9}) {
            const FrameState wanted = at((1 + share) * kFrame);
            const std::vector<Carried> carried = {{ParticleId(0), wanted.position[0], wanted.velocity[0]}};
            const FrameState between = state_between(rest, a, b, share, carried);
            EXPECT_EQ(between.position[0], wanted.position[0]);
            EXPECT_EQ(between.velocity[0], wanted.velocity[0]);
            for (size_t i = 1; i < 4; ++i) {  // straight, or nearly: within an eighth of the change of velocity
                const double bow = (b.velocity[i] - a.velocity[i]).norm() * kFrame / 8;
                EXPECT_LE((between.position[i] - wanted.position[i]).norm(), 1.001 * bow);
            }
            const std::vector<PieceMotion> pieces = piece_motions(rest, a, b, between, carried);
            EXPECT_EQ(pieces[0].acceleration, Vec3::Zero());
            EXPECT_EQ(pieces[0].velocity, wanted.velocity[0]);
        }
    }
}

TEST(StateBetween, an_edge_breaks_at_its_time_and_its_sides_part) {
    const SimulationMesh rest = row(2);
    FrameState a = placed(rest, Vec3::Zero(), Quat::Identity(), Vec3::Zero(), Vec3::Zero());
    a.edge_damage = {0.2}, a.edge_hold = {0.9}, a.stiffness_factor = {1, 1};
    FrameState b = a;
    b.time = kFrame, b.position[1].x() += 0.4, b.edge_intact = {0}, b.edge_damage = {1}, b.edge_hold = {0};
    b.broken = {{EdgeId(0), 0.5 * kFrame, 0.1}};
    const FrameState before = state_between(rest, a, b, 0.49), after = state_between(rest, a, b, 0.5);
    EXPECT_EQ(before.edge_intact[0], 1);
    EXPECT_EQ(before.edge_damage[0], 0.2);
    EXPECT_TRUE(before.broken.empty());
    EXPECT_EQ(after.edge_intact[0], 0);
    EXPECT_EQ(after.edge_damage[0], 1);
    EXPECT_EQ(after.broken, b.broken);
    EXPECT_EQ(after.position[0], a.position[0]);  // rests, to the bit
    EXPECT_DOUBLE_EQ(after.position[1].x() - a.position[1].x(), 0.2);
}

TEST(StateBetween, a_piece_in_flight_accelerates_by_gravity_and_by_its_turn) {
    const SimulationMesh rest = row(4);
    const Vec3 gravity(0, 0, -9.81), velocity(2, 0, 4), spin(3, -40, 20);
    const auto at = [&](double t) {
        FrameState s =
            placed(rest, t * velocity + 0.5 * t * t * gravity, rotation_of(t * spin), velocity + t * gravity, spin);
        s.time = t;
        return s;
    };
    const FrameState a = at(0), b = at(kFrame);
    for (const double share : {0.0, 0.3}) {
        const double t = share * kFrame, dt = 1e-5;
        const FrameState shown = share > 0 ? state_between(rest, a, b, share) : a;
        const std::vector<PieceMotion> pieces = piece_motions(rest, a, b, shown);
        for (size_t i = 0; i < rest.n_particles(); ++i) {
            EXPECT_LT((pieces[i].acceleration - gravity).norm(), 1e-9);
            EXPECT_LT((pieces[i].velocity_at(shown.position[i]) - at(t).velocity[i]).norm(), 1e-9);
            const Vec3 curved = (at(t + dt).position[i] - 2 * at(t).position[i] + at(t - dt).position[i]) / (dt * dt);
            EXPECT_LT((pieces[i].acceleration_at(shown.position[i]) - curved).norm(), 1e-4 * curved.norm());
        }
    }
}

TEST(StateBetween, what_rests_or_is_hit_does_not_accelerate) {
    const SimulationMesh rest = row(2);
    FrameState a = placed(rest, Vec3::Zero(), Quat::Identity(), Vec3(0, 0, -1), Vec3(5, 0, 0)), b = a;
    b.time = kFrame;
    for (const PieceMotion& piece : piece_motions(rest, a, b, a)) {  // it stays where it is, whatever its velocities
        EXPECT_EQ(piece.acceleration_at(Vec3(1, 2, 3)), Vec3::Zero());
        EXPECT_EQ(piece.velocity_at(Vec3(1, 2, 3)), Vec3::Zero());
    }
    FrameState hit = placed(rest, Vec3(0, 0, -0.9 * kFrame), Quat::Identity(), Vec3(0, 0, 8), Vec3(5, 0, 0));
    hit.time = kFrame;
    for (const PieceMotion& piece : piece_motions(rest, a, hit, a)) EXPECT_EQ(piece.acceleration, Vec3::Zero());
}

TEST(StateBetween, rigid_bodies_move_alike_and_plastic_strain_keeps_its_volume) {
    const SimulationMesh rest = row(1);
    FrameState a = placed(rest, Vec3::Zero(), Quat::Identity(), Vec3::Zero(), Vec3::Zero()), b = a;
    const Vec3 spin(0, 0, 0.4 * M_PI / kFrame);
    a.rigid_bodies = {{Vec3::Zero(), Quat::Identity(), Vec3(1, 0, 0), spin}};
    b.rigid_bodies = {{Vec3(kFrame, 0, 0), rotation_of(kFrame * spin), Vec3(1, 0, 0), spin}};
    b.time = kFrame, b.plastic_deformation = {Vec3(2, 0.5, 1).asDiagonal().toDenseMatrix()}, b.yield = {0.5};
    const FrameState s = state_between(rest, a, b, 0.25);
    EXPECT_NEAR(s.rigid_bodies[0].position.x(), 0.25 * kFrame, 1e-15);
    EXPECT_LT(angle_between(s.rigid_bodies[0].orientation, rotation_of(0.25 * kFrame * spin)), 1e-14);
    EXPECT_NEAR(s.rigid_bodies[0].velocity.x(), 1, 1e-14);
    EXPECT_NEAR(s.plastic_deformation[0].determinant(), 1, 1e-14);
    EXPECT_GT(s.plastic_deformation[0](0, 0), 1.1);
    EXPECT_TRUE(std::isinf(s.yield[0]));
    EXPECT_NEAR(s.time, 0.25 * kFrame, 1e-15);
}

}  // namespace
}  // namespace sunder
