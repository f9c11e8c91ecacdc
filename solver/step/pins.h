// What pins hold, and how.
#pragma once

#include "solver/pieces/movables.h"
#include "solver/scene/step_context.h"
#include "solver/step/second_order.h"

namespace sunder {

/// When in a step pinned particles are taken to their pins: all, or those that are in a pair.
enum class Pinned { at_the_end, in_the_first_stage, in_the_middle };

/// Takes them there; they get the speed of their pin. At the end, ties to its pin what one lets go.
void hold_pins(const StepContext& context, const StepTime& time, Pinned when, const StepPair& pair,
               Movables& io_movables);

}  // namespace sunder
