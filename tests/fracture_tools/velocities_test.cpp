// Velocities of the visual mesh against finite differences of its positions.
#include <gtest/gtest.h>

#include <limits>

#include "fracture_tools/skin/particle_transforms.h"
#include "fracture_tools/skin/visual_mesh.h"
#include "tests/fracture_tools/bent_strip.h"
#include "tests/fracture_tools/moving_body.h"

namespace sunder {
namespace {

using testing::MovingBody;

ParticleMaps maps(const MovingBody& body) {
    ParticleTransforms transforms(body.rest);
    ParticleMaps out;
    transforms.evaluate(body.position, body.orientation, body.plastic, body.intact, out);
    return out;
}

void expect_rates_of_maps(MovingBody body, double least = 0.5) {
    constexpr double kTime = 0.3, kStep = 1e-5;  // s
    body.move_to(kTime - kStep);
    const ParticleMaps before = maps(body);
    body.move_to(kTime + kStep);
    const ParticleMaps after = maps(body);
    body.move_to(kTime);
    ParticleTransforms transforms(body.rest);
    ParticleMaps now;
    ParticleMapRates rates;
    transforms.evaluate(body.position, body.orientation, body.plastic, body.intact, now);
    transforms.rates(body.position, body.velocity, body.angular_velocity, body.intact, rates);
    double largest = 0;
    for (size_t i = 0; i < rates.carried.size(); ++i) {
        const Mat3 linear = (after.carried[i].linear - before.carried[i].linear) / (2 * kStep);
        const Vec3 offset = (after.carried[i].offset - before.carried[i].offset) / (2 * kStep);
        // kStep^2 times third derivatives of some 100 / s3, and rounding of 1e-16 / kStep
        EXPECT_LT((rates.carried[i].linear - linear).norm(), 1e-7) << i;
        EXPECT_LT((rates.carried[i].offset - offset).norm(), 1e-7) << i;
        if (now.bend()) {
            const Mat3 turned = (after.turned[i].linear - before.turned[i].linear) / (2 * kStep);
            const Vec3 arm = (after.turned[i].offset - before.turned[i].offset) / (2 * kStep);
            const Eigen::Vector4d turn = (after.turn[i].coeffs() - before.turn[i].coeffs()) / (2 * kStep);
            EXPECT_LT((rates.turned[i].linear - turned).norm(), 1e-7) << i;
            EXPECT_LT((rates.turned[i].offset - arm).norm(), 1e-7) << i;
            EXPECT_LT((rates.turn[i].coeffs() - turn).norm(), 1e-7) << i;
        }
        largest = std::max(largest, rates.carried[i].linear.norm());
    }
    EXPECT_GT(largest, least);
}

MovingBody moving_sheet() {
    const testing::VoronoiBody strip = testing::strip_body(2, 0.3, false);
    MovingBody body{{std::make_shared<FragmentSet>(*strip.set), strip.rest, strip.position, strip.orientation,
                     strip.plastic, strip.intact},
                    {},
                    {}};
    for (Vec3& x : body.rest.rest_position) x *= 0.2;  // as in the other body, 0.2 m apart
    for (Vec3& x : body.fragments->vertices) x *= 0.2;
    for (Vec3& r : body.rest.radii) r *= 0.2;
    for (double& v : body.rest.volume) v *= 0.008;
    for (Edge& e : body.rest.edges) e.area *= 0.04;
    body.move_to(0.3);
    return body;
}

TEST(Velocities, particle_maps_change_at_the_rate_that_is_told) {
    MovingBody body = testing::moving_body();
    for (const double share : {0.0, 0.3, 1.0}) {
        body.break_share(share, 1);
        expect_rates_of_maps(body);
    }
}

TEST(Velocities, also_of_sheets) {
    MovingBody body = moving_sheet();
    for (const double share : {0.0, 0.3}) {
        body.break_share(share, 1);
        expect_rates_of_maps(body, 0.1);  // half of each arm is elsewhere
    }
    ASSERT_TRUE(maps(body).bend());
}

TEST(Velocities, also_where_the_elastic_part_is_limited) {
    MovingBody body = testing::moving_body();
    for (Vec3& x : body.rest.rest_position) x *= 0.4;  // as if stretched by 150 %
    expect_rates_of_maps(body);
}

TEST(Velocities, vertices_move_as_finite_differences_of_frames_tell) {
    constexpr double kTime = 0.3, kStep = 1e-3;  // s
    const MovingBody bodies[] = {testing::moving_body(), moving_sheet()};
    for (const VisualTopology topology : {VisualTopology::compact, VisualTopology::constant})
        for (const double share : {0.0, 0.3, 1.3}) {
            MovingBody body = bodies[share > 1 ? 1 : 0];
            body.break_share(share > 1 ? share - 1 : share, 2);
            VisualMeshBuilder builder(body.fragments, body.rest, {}, topology);
            body.move_to(kTime - kStep);
            const VisualMesh before = builder.build(body.frame()).take();
            body.move_to(kTime + kStep);
            const VisualMesh after = builder.build(body.frame()).take();
            body.move_to(kTime);
            const VisualMesh now = builder.build(body.frame()).take();
            ASSERT_EQ(now.velocities.size(), now.positions.size());
            for (size_t v = 0; v < now.positions.size(); ++v) {
                const Vec3f difference = (after.positions[v] - before.positions[v]) / float(2 * kStep);
                // positions are floats: 2^-24 m / kStep
                ASSERT_LT((now.velocities[v] - difference).norm(), 3e-4f);
                ASSERT_GT(now.velocities[v].norm(), 1);
            }
        }
}

TEST(Velocities, a_lone_fragment_moves_rigidly) {
    MovingBody body = testing::moving_body();
    std::fill(body.intact.begin(), body.intact.end(), 0);
    VisualMeshBuilder builder(body.fragments, body.rest, {}, VisualTopology::constant);
    const VisualMesh mesh = builder.build(body.frame()).take();
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        const uint32_t i = mesh.vertex_fragment[v];
        const Vec3 arm = mesh.positions[v].cast<double>() - body.position[i];
        const Vec3 truth = body.velocity[i] + body.angular_velocity[i].cross(arm);
        ASSERT_LT((mesh.velocities[v].cast<double>() - truth).norm(), 1e-6);
    }
}

TEST(Velocities, are_left_out_when_the_frame_tells_none_and_refused_when_they_do_not_fit) {
    MovingBody body = testing::moving_body();
    VisualMeshBuilder builder(body.fragments, body.rest, {});
    BodyFrame frame = body.frame();
    frame.velocity = frame.angular_velocity = {};
    EXPECT_TRUE(builder.build(frame).take().velocities.empty());
    frame = body.frame();
    frame.angular_velocity = frame.angular_velocity.first(3);
    EXPECT_EQ(builder.build(frame).error().code, ErrorCode::bad_input);
    body.velocity[4].x() = std::numeric_limits<double>::quiet_NaN();
    const auto bad = builder.build(body.frame());
    ASSERT_FALSE(bad);
    EXPECT_EQ(bad.error().code, ErrorCode::numerical);
    EXPECT_NE(bad.error().what.find("particle 4"), std::string::npos);
}

}  // namespace
}  // namespace sunder
