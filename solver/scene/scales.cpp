#include "solver/scene/scales.h"

namespace sunder {
namespace {

// Of the speed of a fall; what flows is meant to go on slowly.
constexpr double kStill = 0.005, kStillWhileFlowing = 0.001, kWaking = 0.05, kHard = 0.2;

}  // namespace

FieldsOfForce::FieldsOfForce(const FrameInput& input) : acceleration(input.gravity) {
    for (const Force& f : input.forces) acceleration += f.acceleration + f.drag * f.wind, drag += f.drag;
}

double acceleration_of(const FrameInput& input) { return FieldsOfForce(input).acceleration.norm(); }

double still_speed(double size, double g, bool flows) {
    return (flows ? kStillWhileFlowing : kStill) * speed_of_fall(size, g);
}
double waking_speed(double size, double g) { return kWaking * speed_of_fall(size, g); }
double hard_speed(double size, double g) { return kHard * speed_of_fall(size, g); }

}  // namespace sunder
