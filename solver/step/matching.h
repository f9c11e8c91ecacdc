// Shape matching as a step keeps it.
#pragma once

#include <vector>

#include "solver/data/role.h"
#include "solver/matching/jacobi_sweep.h"
#include "solver/matching/newton_step.h"
#include "solver/matching/section_flow.h"

namespace sunder {

struct Matching {
    std::vector<GroupGoal> goals;     // (n_particles)
    std::vector<Role> role;           // as matching sees it: what it is to leave alone is held (n_particles)
    std::vector<uint8_t> left_alone;  // a particle of it is held, or all of it is to be left alone (n_pieces)
    std::vector<uint8_t> unloaded;    // pieces whose Newton steps start from where they are taken (n_pieces)
    FlowWithin flow;                  // of thin groups
    NewtonStep newton;
    JacobiSweep jacobi;
};

}  // namespace sunder
