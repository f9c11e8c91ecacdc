// The optimal rotation of shape matching (Choi 2014, Eq. 1): the rotation R that maximises tr(R^T A).
#pragma once

#include "solver/data/math.h"

namespace sunder {

/// Newton's method on the rotation group from a warm start (analytic polar decomposition), guarded: the result is
/// accepted only where tr(R^T A) has a proper maximum (its Hessian tr(B) I - sym(B), B = R^T A, is positive definite);
/// otherwise the exact singular value decomposition decides. A may be singular or reflected; det R = +1 always.
/// A of zeros gives `warm_start` back. Units of A do not matter.
Quat optimal_rotation(const Mat3& A, const Quat& warm_start);

/// The same by singular value decomposition, R = U diag(1, 1, det(U V^T)) V^T; the reference and the fallback.
Quat optimal_rotation_svd(const Mat3& A);
/// As numbers, for kernels: A row by row, the rotation as x, y, z, w.
void optimal_rotation_svd(const double* A, double* o_rotation);

}  // namespace sunder
