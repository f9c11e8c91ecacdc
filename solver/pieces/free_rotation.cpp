#include "solver/pieces/free_rotation.h"

#include <algorithm>
#include <cmath>

#include "solver/scene/motion.h"

namespace sunder {
namespace {

constexpr double kInnerAngle = 0.25;     // rad, at most in an inner step
constexpr double kMostInnerSteps = 256;  // beyond it only the energy's accuracy suffers: |L| bounds it still

// Turns the frame about its own axis and, with it, the body's view of L.
void turn_about(int axis, double angle, Quat& io_frame, Vec3& io_L_body) {
    const Quat turn = rotation_of(angle * Vec3::Unit(axis));
    io_frame = io_frame * turn;
    io_L_body = turn.conjugate() * io_L_body;
}

}  // namespace

Turning turn_freely(const Quat& start, const Vec3& moments, const Vec3& L, double h) {
    const Vec3 inverse = moments.cwiseInverse();
    int low, high;
    inverse.minCoeff(&low), inverse.maxCoeff(&high);
    Turning result{start, Vec3::Zero()};
    double sphere = inverse(0);  // 1/moment of the part that turns about L as a sphere does
    if (low != high) {
        const int middle = 3 - low - high;
        sphere = inverse(middle);
        const double slow = inverse(low) - sphere, fast = inverse(high) - sphere;  // <= 0, >= 0
        Vec3 L_body = start.conjugate() * L;
        const double angle = h * L.norm() * (fast - slow);
        const double steps = std::clamp(std::ceil(angle / kInnerAngle), 1.0, kMostInnerSteps), dt = h / steps;
        for (int k = 0; k < int(steps); ++k) {
            turn_about(low, 0.5 * dt * slow * L_body(low), result.frame, L_body);
            turn_about(high, dt * fast * L_body(high), result.frame, L_body);
            turn_about(low, 0.5 * dt * slow * L_body(low), result.frame, L_body);
        }
    }
    result.frame = (rotation_of(h * sphere * L) * result.frame).normalized();
    result.angular_velocity = result.frame * inverse.cwiseProduct(result.frame.conjugate() * L);
    return result;
}

}  // namespace sunder
