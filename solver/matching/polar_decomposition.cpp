#include "solver/matching/polar_decomposition.h"

#include <Eigen/SVD>
#include <cmath>

namespace sunder {
namespace {

// Warm starts need two or three iterations; more than this means that the start was far off.
constexpr int kMaxIterations = 12;
// Squared last step, rad^2. Newton converges quadratically: after a step of 1e-7 the error is about 1e-14.
constexpr double kConverged = 1e-14;
// Smallest pivot of the Hessian, beside its trace, that counts as a proper maximum. An inverted or nearly
// inverted group lies below and is left to the exact decomposition.
constexpr double kProperMaximum = 1e-9;

}  // namespace

Quat optimal_rotation_svd(const Mat3& A) {
    const Eigen::JacobiSVD<Mat3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Mat3 U = svd.matrixU();
    const Mat3& V = svd.matrixV();
    if (U.determinant() * V.determinant() < 0) U.col(2) = -U.col(2);  // smallest singular value last
    return Quat(Mat3(U * V.transpose())).normalized();
}

void optimal_rotation_svd(const double* A, double* o_rotation) {
    const Mat3 matrix = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(A);
    const Quat R = optimal_rotation_svd(matrix);
    for (int i = 0; i < 4; ++i) o_rotation[i] = R.coeffs()(i);
}

Quat optimal_rotation(const Mat3& A, const Quat& warm_start) {
    const double scale = A.norm();
    if (!(scale > 0)) return warm_start;

    Quat q = warm_start;
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
        const Mat3 B = q.toRotationMatrix().transpose() * A;
        // Gradient of tr(R^T A) for R <- R exp([w]x), and (minus) its Hessian.
        const Vec3 gradient(B(2, 1) - B(1, 2), B(0, 2) - B(2, 0), B(1, 0) - B(0, 1));
        const double trace = B.trace();
        const double xx = trace - B(0, 0), yy = trace - B(1, 1), zz = trace - B(2, 2);
        const double xy = -0.5 * (B(0, 1) + B(1, 0)), xz = -0.5 * (B(0, 2) + B(2, 0)), yz = -0.5 * (B(1, 2) + B(2, 1));

        // Adjugate and leading minors: positive definite exactly when all three minors are positive.
        const double c00 = yy * zz - yz * yz, c01 = xz * yz - xy * zz, c02 = xy * yz - xz * yy;
        const double c11 = xx * zz - xz * xz, c12 = xy * xz - xx * yz, c22 = xx * yy - xy * xy;
        const double det = xx * c00 + xy * c01 + xz * c02;
        const double tiny = kProperMaximum * scale;
        if (!(xx > tiny && c22 > tiny * scale * 1e-3 && det > tiny * scale * scale * 1e-6))
            return optimal_rotation_svd(A);

        const Vec3 w = Vec3(c00 * gradient.x() + c01 * gradient.y() + c02 * gradient.z(),
                            c01 * gradient.x() + c11 * gradient.y() + c12 * gradient.z(),
                            c02 * gradient.x() + c12 * gradient.y() + c22 * gradient.z()) /
                       det;
        const double step = w.squaredNorm();
        if (step > 1.0) return optimal_rotation_svd(A);  // half a radian and more: not a warm start
        // Cayley map of w, second order in w like the exponential, and exactly a rotation after normalising.
        q = (q * Quat(1.0, 0.5 * w.x(), 0.5 * w.y(), 0.5 * w.z())).normalized();
        if (step < kConverged) return q;
    }
    return optimal_rotation_svd(A);
}

}  // namespace sunder
