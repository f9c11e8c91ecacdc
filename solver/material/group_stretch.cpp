#include "solver/material/group_stretch.h"

#include <algorithm>
#include <cstddef>

#include "solver/data/invariant.h"
#include "solver/data/math_functions.h"
#include "solver/lanes/instruction_set.h"
#include "solver/matching/polar_decomposition.h"
#include "solver/matching/sweep_store.h"

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
               numbers(live.members()).data(),
               kOrientationWeight,
               kStretchMomentWeight,
               optimal_rotation_svd},
      kernels_(&SUNDER_BEST_KERNELS(kStretchKernels)) {
    constexpr size_t kNumber = sizeof(double);
    SUNDER_ASSERT(!goals.empty() && shapes.group.size() == goals.size() && shapes.member.size() == live.n_slots());
    SUNDER_ASSERT(live.ends().size() == goals.size() && particles.size() >= goals.size());
    static_assert(sizeof(GroupGoal) == 4 * kNumber);
    static_assert(sizeof(GroupShape) == StretchRecords::kShapeNumbers * kNumber);
    static_assert(offsetof(GroupShape, stretch) + offsetof(StretchBasis, V) == StretchRecords::kV * kNumber &&
                  offsetof(GroupShape, stretch) + offsetof(StretchBasis, Lam) == StretchRecords::kLam * kNumber &&
                  offsetof(GroupShape, isotropy) == StretchRecords::kIsotropy * kNumber);
}

PrincipalStretch principal_stretch(const PrincipalLanes& principal, size_t i) {
    Mat3 directions;
    for (size_t k = 0; k < 9; ++k) directions.data()[k] = principal.directions[k][i];
    return principal_stretch(Vec3(principal.stretch[0][i], principal.stretch[1][i], principal.stretch[2][i]),
                             directions);
}

double largest_strain(const PrincipalLanes& principal, size_t i) {
    const auto bounded = [](double stretch) { return std::clamp(stretch, kSmallestStretch, kLargestStretch); };
    return math::log(std::max(bounded(principal.stretch[2][i]), 1 / bounded(principal.stretch[0][i])));
}

}  // namespace sunder
