// Plastic flow of one group.
#pragma once

#include "solver/lanes/instruction_set.h"
#include "solver/material/plasticity.h"

namespace sunder::test {

inline FlowResult flow(const PrincipalStretch& stretch, const Material& material, double h, PlasticState& io_state) {
    FlowingGroup group{stretch, material, io_state};
    std::array<FlowResult, 4> results;
    sunder::flow({&group, 1}, h, SUNDER_BEST_KERNELS(kStretchKernels), results);
    io_state = group.plastic;
    return results[0];
}

}  // namespace sunder::test
