// A body of 60 fragments in smooth motion, for tests of what the deformer makes of time.
#pragma once

#include <cmath>

#include "fracture_tools/skin/visual_mesh.h"
#include "tests/fracture_tools/tetrahedral_bodies.h"

namespace sunder::testing {

struct MovingBody : Body {
    std::vector<Vec3> velocity, angular_velocity;

    /// Particle i swings about its rest position and turns about an axis of its own: analytic, so that velocities are
    /// exact, and gentle, so that no elastic part passes its limit, where the derivative jumps.
    void move_to(double time) {
        velocity.resize(position.size()), angular_velocity.resize(position.size());
        for (size_t i = 0; i < position.size(); ++i) {
            const double phase = 0.7 * double(i), pace = 3;
            const Vec3 axis = Vec3(std::sin(phase), std::cos(3 * phase), 1).normalized();
            const Vec3 swing = 0.01 * Vec3(std::cos(2 * phase), std::sin(phase), std::cos(phase));
            position[i] = rest.rest_position[i] + std::sin(pace * time + phase) * swing + Vec3(0, 0, 2 * time);
            velocity[i] = pace * std::cos(pace * time + phase) * swing + Vec3(0, 0, 2);
            const double angle = 0.2 * std::sin(pace * time), rate = 0.2 * pace * std::cos(pace * time);
            orientation[i] = Quat(Eigen::AngleAxisd(angle, axis)) * rest.rest_orientation[i];
            angular_velocity[i] = rate * axis;
        }
    }
    void break_share(double share, uint32_t seed) {
        std::mt19937 random(seed);
        for (uint8_t& i : intact) i = random() / 4294967296.0 >= share;
    }
    BodyFrame frame() const { return {position, orientation, plastic, intact, velocity, angular_velocity}; }
};

inline MovingBody moving_body() {
    const TetBox box = make_tet_box({8, 8, 12}, 0.1, 0.2);
    MovingBody body{make_body(box, kmeans_labels(box, 60, 7)), {}, {}};
    for (size_t i = 0; i < body.plastic.size(); ++i)
        body.plastic[i] = Vec3(1 + 0.003 * double(i), 1, 1 / (1 + 0.003 * double(i))).asDiagonal();
    body.move_to(0.3);
    return body;
}

}  // namespace sunder::testing
