// Shots drawn at random under a press that is driven down to a tenth to six tenths of the body: what it squeezes may be
// thrown, but not like a bullet.
#include <gtest/gtest.h>

#include "tests/stability/random_shot.h"
#include "tests/support/lattice_scene.h"

namespace sunder {
namespace {

struct Pressed : test::Shot {
    static constexpr int kFrames = 36;
    static constexpr double kRate = 24;  // frames a second
    double size = 0;                     // from the middle of a body to where it ends, m
    double top = 0, low = 0;             // of the press, m
    double stroke = 0;                   // frames

    explicit Pressed(uint64_t seed) : Shot(seed) {
        scene.rigid_bodies.clear();
        for (const Vec3& x : scene.rest.rest_position) size = std::max(size, x.norm());
        for (Body& b : scene.bodies) b.velocity *= 0.1, b.angular_velocity *= 0.1;
        test::Draw draw(seed + 777);
        Collider press;
        press.name = "press", press.friction = material.friction;
        press.shape.kind = ShapeKind::box, press.shape.half_extents = size * Vec3(1.5, 1.5, 0.1);
        if (draw.one_in(3)) press.shape.kind = ShapeKind::sphere, press.shape.radius = 0.3 * size;
        scene.colliders.push_back(press);
        top = 1.35 * size, low = size * (0.1 + draw.uniform(0, 0.5)), stroke = draw.of({12, 24, 36});
    }
    Pose pose(int frame) const {
        const double done = 0.5 - 0.5 * std::cos(M_PI * std::min(1.0, frame / stroke));
        return {Vec3(0, 0, top + (low - top) * done), Quat::Identity()};
    }
    // Of the press where it is fastest, and of a fall by twice the body's size, m/s.
    double scale() const { return 0.5 * M_PI * (top - low) * kRate / stroke + std::sqrt(4 * gravity * size); }
};

// The fastest that anything ever was, over `scale`.
double fastest(uint64_t seed) {
    const Pressed shot(seed);
    const auto solver = test::make_solver(shot.scene);
    FrameState state = solver->initial_state(shot.materials());
    FrameInput in = shot.input();
    double fastest = 0;
    for (int frame = 0; frame < Pressed::kFrames; ++frame) {
        in.colliders[1] = {shot.pose(frame), shot.pose(frame + 1), true};
        const auto report = solver->advance(in, shot.settings, state);
        EXPECT_TRUE(report) << "shot " << seed << ": " << (report ? "" : report.error().text());
        if (!report) break;
        for (const Vec3& v : state.velocity) fastest = std::max(fastest, v.norm());
    }
    return fastest / shot.scale();
}

TEST(press, throws_nothing_like_a_bullet) {
    double most = 0;
    uint64_t worst = 0;
    const auto check = [&](uint64_t seed) {
        const double speed = fastest(seed);
        // What slips out of a wedge goes faster than what drives it, by one over its slope.
        EXPECT_LE(speed, 8) << "shot " << seed;
        if (speed > most) most = speed, worst = seed;
    };
    for (uint64_t seed = 0; seed < 60; ++seed) check(seed);
    for (uint64_t seed : {144, 165, 277, 298, 313, 370, 391,  428,  619,  635,  689,  742,
                          766, 795, 882, 924, 946, 988, 1034, 1055, 1170, 1338, 1387, 1393})
        check(seed);  // once 8 to 570 times
    std::printf("fastest: %.1f times the speed of press and fall, shot %d\n", most, static_cast<int>(worst));
}

}  // namespace
}  // namespace sunder
