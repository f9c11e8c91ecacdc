#include "solver/matching/optimal_stretch.h"

#include <algorithm>

#include "solver/data/math_functions.h"

namespace sunder {

PrincipalStretch principal_stretch(const Vec3& stretch, const Mat3& directions) {
    PrincipalStretch p{stretch, Vec3::Zero(), directions, stretch(0) > kSmallestStretch};
    for (int i = 0; i < 3; ++i)
        p.log_strain(i) = math::log(std::clamp(p.stretch(i), kSmallestStretch, kLargestStretch));
    return p;
}

}  // namespace sunder
