#include "solver/plasticity.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sunder {
namespace {

// The symmetric right polar factor P of F (F = Q P), its principal stretches brought to det 1 and within the ratio.
struct RightFactor {
    Mat3 P;
    Quat Q;
};
RightFactor right_factor(const Mat3& F) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(F.transpose() * F));
    Vec3 log_p = 0.5 * eigen.eigenvalues().array().log();
    const Mat3& U = eigen.eigenvectors();
    const Mat3 inverse = U * Vec3((-log_p.array()).exp()).asDiagonal() * U.transpose();
    log_p.array() -= log_p.mean();
    if (const double spread = log_p(2) - log_p(0), limit = std::log(kMaxPlasticRatio); spread > limit)
        log_p *= limit / spread;
    return {U * Vec3(log_p.array().exp()).asDiagonal() * U.transpose(), Quat(Mat3(F * inverse)).normalized()};
}

}  // namespace

FlowResult flow(const PrincipalStretch& stretch, const Material& material, double h, PlasticState& io_state) {
    FlowResult result{stretch.log_strain, Quat::Identity(), false};
    if (!stretch.reliable || io_state.yield == kNever) return result;

    const double volumetric = stretch.log_strain.mean();
    const Vec3 deviator = stretch.log_strain.array() - volumetric;
    const double size = deviator.cwiseAbs().maxCoeff();  // only the deviator yields: pressure alone must not melt
    if (!(size > io_state.yield)) return result;

    const double gamma = -std::expm1(-material.flow_rate * h) * (size - io_state.yield) / size;
    const Vec3 flowed = gamma * deviator;
    const Mat3& V = stretch.directions;
    const RightFactor next = right_factor(V * Vec3(flowed.array().exp()).asDiagonal() * V.transpose() * io_state.F_P);

    result.flowed = gamma > 0;
    result.elastic_log_strain = stretch.log_strain - flowed;
    result.spin = next.Q;
    io_state.F_P = next.P;
    if (material.hardening > 0) {
        const double cap =
            material.toughness == kNever ? kNever : std::max(io_state.yield, kHardeningCap * material.toughness);
        io_state.yield = std::min(io_state.yield + material.hardening * gamma * size, cap);
    }
    return result;
}

}  // namespace sunder
