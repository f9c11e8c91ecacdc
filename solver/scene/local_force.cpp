#include "solver/scene/local_force.h"

#include "solver/data/math_functions.h"

namespace sunder {

double Falloff::at(double distance) const {
    if (!(distance <= reach)) return 0;
    return distance < radius ? distance / radius : math::pow(radius / distance, exponent);
}

bool acts(const Force& force) { return !force.local || !std::holds_alternative<Nothing>(force.local->kind); }

}  // namespace sunder
