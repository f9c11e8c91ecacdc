#include "solver/group_stretch.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "solver/instruction_set.h"
#include "solver/polar_decomposition.h"
#include "solver/sweep_store.h"

namespace sunder {

GroupStretcher::GroupStretcher(const LiveTopology& live, const GroupShapes& shapes,
                               std::span<const MovingParticle> particles, std::span<const GroupGoal> goals)
    : records_{moving_records(particles),
               goals.data()->rotation.coeffs().data(),
               shapes.member.data()->q.data(),
               shapes.particle_mass.data(),
               shapes.particle_moment.data()->data(),
               &shapes.group.data()->mass,
               live.begins().data(),
               live.ends().data(),
               live.members().data(),
               kOrientationWeight,
               kStretchMomentWeight,
               optimal_rotation_svd},
      kernels_(&SUNDER_BEST_KERNELS(kStretchKernels)) {
    constexpr size_t kNumber = sizeof(double);
    static_assert(sizeof(GroupGoal) == 4 * kNumber);
    static_assert(sizeof(GroupShape) == StretchRecords::kShapeNumbers * kNumber);
    static_assert(offsetof(GroupShape, stretch) + offsetof(StretchBasis, V) == StretchRecords::kV * kNumber &&
                  offsetof(GroupShape, stretch) + offsetof(StretchBasis, Lam) == StretchRecords::kLam * kNumber &&
                  offsetof(GroupShape, isotropy) == StretchRecords::kIsotropy * kNumber);
}

std::array<double, 4> GroupStretcher::largest_strains(const GroupStretches& stretches) const {
    double least[4], largest[4];
    kernels_->find_bounds(stretches, least, largest);
    std::array<double, 4> strains;
    for (size_t i = 0; i < 4; ++i) {
        const auto bounded = [](double lambda) { return std::clamp(lambda, kSmallestStretch, kLargestStretch); };
        strains[i] = std::log(std::max(bounded(largest[i]), 1 / bounded(least[i])));
    }
    return strains;
}

}  // namespace sunder
