#include "solver/group_stretch.h"

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

std::array<Vec3, 4> GroupStretcher::principal_stretches(const GroupStretches& s) const {
    double least[4], largest[4];
    kernels_->find_bounds(s, least, largest);
    std::array<Vec3, 4> stretch;
    for (size_t i = 0; i < 4; ++i) {
        const double middle = s.S[0][i] + s.S[1][i] + s.S[2][i] - least[i] - largest[i];
        stretch[i] = Vec3(least[i], middle, largest[i]).cwiseMax(kSmallestStretch).cwiseMin(kLargestStretch);
    }
    return stretch;
}

}  // namespace sunder
