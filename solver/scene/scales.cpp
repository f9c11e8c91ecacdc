#include "solver/scene/scales.h"

#include <algorithm>
#include <numeric>

#include "solver/data/math_functions.h"

namespace sunder {
namespace {

// Of the speed of a fall; what flows is meant to go on slowly.
constexpr double kStill = 0.005, kStillWhileFlowing = 0.001, kWaking = 0.05, kHard = 0.2;
// Of the time that a wave takes through a fragment: 2 ms in one of 0.1 m at 0.2 MPa.
constexpr double kDampedWave = 0.3;

}  // namespace

FieldsOfForce::FieldsOfForce(const FrameInput& input) : acceleration(input.gravity) {
    for (const Force& f : input.forces) acceleration += f.acceleration + f.drag * f.wind, drag += f.drag;
}

double acceleration_of(const FrameInput& input) { return FieldsOfForce(input).acceleration.norm(); }

double calm_speed(const FrameInput& input, double size) {
    constexpr double kFallen = 1.5;  // frames
    return kFallen * input.duration * acceleration_of(input) + kCalm * size / input.duration;
}

double still_speed(double size, double g, bool flows) {
    return (flows ? kStillWhileFlowing : kStill) * speed_of_fall(size, g);
}
double waking_speed(double size, double g) { return kWaking * speed_of_fall(size, g); }
double hard_speed(double size, double g) { return kHard * speed_of_fall(size, g); }

double automatic_damping_time(const SimulationMesh& body, double youngs_modulus) {
    const double volume = std::accumulate(body.volume.begin(), body.volume.end(), 0.0);
    const double mass = std::accumulate(body.mass.begin(), body.mass.end(), 0.0);
    const double size = math::cbrt(volume / static_cast<double>(body.n_particles()));
    return std::min(kDampedWave * size / wave_speed(youngs_modulus, volume, mass), kLongestDampingTime);
}

double opening_length(const Material& material, double toughness) {
    return 2 * material.fracture_energy / (material.youngs_modulus * toughness * toughness);
}

double automatic_fracture_energy(const SimulationMesh& body, double youngs_modulus, double toughness) {
    Vec3 least = Vec3::Constant(kNever), most = -least;
    for (size_t i = 0; i < body.n_particles(); ++i) {
        least = least.cwiseMin(body.rest_position[i] - body.radii[i]);
        most = most.cwiseMax(body.rest_position[i] + body.radii[i]);
    }
    const double length = (most - least).maxCoeff() / 4;
    return youngs_modulus * toughness * toughness * length / 2;
}

}  // namespace sunder
