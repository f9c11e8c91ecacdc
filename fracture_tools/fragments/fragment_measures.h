// The principal frame that a fragment, hence its particle, has at rest.
#pragma once

#include "solver/data/math.h"

namespace sunder {

/// Principal axes of a symmetric positive matrix as a rotation (frame -> world): longest axis first, right-handed,
/// of the possible signs the one with positive largest components. Where moments are equal the axes are not
/// determined by the matrix: they then lie as near the world's as can be, so that equal shapes have equal frames.
Quat principal_frame(const Mat3& covariance);

}  // namespace sunder
