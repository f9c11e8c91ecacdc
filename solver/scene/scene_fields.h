// What the numbers of a scene are called, mean and permit: a parameter is described here and used where it acts.
#pragma once

#include "solver/data/fields.h"
#include "solver/scene/scene.h"

namespace sunder {

/// All of a Material, in the order in which they are hashed.
std::span<const Field<Material>> material_fields();

/// All of SolverSettings but the method.
std::span<const Field<SolverSettings>> settings_fields();

/// All of a StepReport.
std::span<const Field<StepReport>> report_fields();

}  // namespace sunder
