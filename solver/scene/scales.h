// The scales of a frame, each defined here alone: what pulls at things, what is slow beside how they fall, and how far
// waves run.
#pragma once

#include <cmath>

#include "solver/scene/scene.h"

namespace sunder {

/// What gravity, wind and drag make of a velocity, where they are the same everywhere in a scene.
struct FieldsOfForce {
    explicit FieldsOfForce(const FrameInput& input);
    Vec3 after(double seconds, const Vec3& velocity) const {
        return (velocity + seconds * acceleration) / (1 + seconds * drag);  // implicit drag
    }
    Vec3 acceleration;  // of what does not move, m/s2
    double drag = 0;    // 1/s
};

/// g: how fast the fields accelerate what does not move, m/s2. Gravity is one of them, and a force of the same
/// acceleration another way to say it.
double acceleration_of(const FrameInput& input);

constexpr double kCalm = 0.01;  // of its size a frame: what deforms more slowly rests
/// m/s: what is stopped from less than that rests; `size` in m.
double calm_speed(const FrameInput& input, double size);

/// m; how much farther what falls gets in a step of `h` seconds.
inline double fall_in_step(double h, double g) { return g * h * h; }

/// m/s; of things of that size (m) that fall, tip and slide.
inline double speed_of_fall(double size, double g) { return std::sqrt(g * size); }

/// m/s; a contact at rest closes at h g, and what closes at no more than twice that rests: it does not bounce.
inline double resting_speed(double h, double g) { return 2 * h * g; }

/// m/s; what moves from frame to frame more slowly than this hardly moves: 0.005 of the speed of a fall is that of one
/// by an 80,000th of the size, and moves a fragment of 6 cm by 3 % of its size in the time to sleep. What flows is
/// meant to go on slowly: 0.001. Where nothing falls there is no such scale: things sleep only if they do not move at
/// all.
double still_speed(double size, double g, bool flows);

/// m/s; awake things that approach a sleeper faster wake it when they touch it, and beside them nothing falls asleep.
double waking_speed(double size, double g);

/// m/s; what slides along a sleeper faster wakes it, too; and one that is hit faster wakes with all that it presses on,
/// for it passes the hit on: a fall by a fiftieth of the size.
double hard_speed(double size, double g);

/// m/s; c = sqrt(E/rho): waves in so stiff a material (Pa) of that volume (m3) and mass (kg).
inline double wave_speed(double youngs_modulus, double volume, double mass) {
    return std::sqrt(youngs_modulus * volume / mass);
}

constexpr double kLongestDampingTime = 1;  // s

/// s; damping of a body by the time that a wave takes through a fragment of its mean size: what a hit sets ringing dies
/// away as soon in stiff bodies as in soft ones. `body`: its particles alone.
double automatic_damping_time(const SimulationMesh& body, double youngs_modulus);

/// L, m: what a crack has to open by over the toughness, from sound to parted.
double opening_length(const Material& material, double toughness);

/// The fracture energy of "auto", J/m2: E tau^2 L / 2 with L half of the body's half size, that is a quarter of the
/// longest side of its fragments' bounding box. `body`: its particles alone.
double automatic_fracture_energy(const SimulationMesh& body, double youngs_modulus, double toughness);

/// c h / d: how far waves run in a step, in distances between particles, where the groups of a particle pull at it by
/// `pulls` = sum_g b_g, b = h^2 k. A lattice has 7 groups of b = (c h / d)^2 / 2 at a particle.
inline double waves_in_step(double pulls) {
    constexpr double kWavePerWeight = 0.29;  // (c h / d)^2 over sum_g b_g
    return std::sqrt(kWavePerWeight * pulls);
}

}  // namespace sunder
