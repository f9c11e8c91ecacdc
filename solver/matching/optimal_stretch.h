// What the optimal stretch of shape matching (Choi 2014, Eq. 2-8) is found from, and what is read off it.
#pragma once

#include "solver/data/math.h"

namespace sunder {

/// Eigensystem of A_qq, kept while the group's rest shape keeps: A_qq = V diag(a) V^T.
struct StretchBasis {
    Mat3 V = Mat3::Identity();
    Sym3 Lam = {1, 1, 1};  // 2 / (a_i + a_j), 1/(kg m2)
};

/// Beyond these the logarithm of a stretch is of no use (numerics: inverted groups).
constexpr double kSmallestStretch = 0.1, kLargestStretch = 10;

/// Principal stretches and directions, ascending.
struct PrincipalStretch {
    Vec3 stretch = Vec3::Ones();         // lambda, -
    Vec3 log_strain = Vec3::Zero();      // log of lambda clamped to [0.1, 10], -
    Mat3 directions = Mat3::Identity();  // columns e_i, in the frame that R turns
    bool reliable = true;                // false: some lambda <= 0.1 (collapsed or inverted): no flow, no fracture
};
PrincipalStretch principal_stretch(const Vec3& stretch, const Mat3& directions);

}  // namespace sunder
