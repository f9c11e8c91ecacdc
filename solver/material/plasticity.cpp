#include "solver/material/plasticity.h"

#include <algorithm>

#include "solver/data/math_functions.h"

namespace sunder {
namespace {

// Of the strain above the yield surface what flows, in the strain's own principal directions.
struct Excess {
    double size = 0, gamma = 0;
    Vec3 flowed = Vec3::Zero();  // log strain
};

Excess excess_strain(const FlowingGroup& group, double h) {
    Excess excess;
    if (!group.stretch.reliable || group.plastic.yield == kNever) return excess;
    const Vec3& strain = group.stretch.log_strain;
    const Vec3 deviator = strain.array() - strain.mean();
    excess.size = deviator.cwiseAbs().maxCoeff();  // only the deviator yields: pressure alone must not melt
    if (!(excess.size > group.plastic.yield)) return excess;
    excess.gamma = -math::expm1(-group.material.flow_rate * h) * (excess.size - group.plastic.yield) / excess.size;
    excess.flowed = excess.gamma * deviator;
    return excess;
}

double hardened(const FlowingGroup& group, const Excess& excess) {
    const Material& m = group.material;
    const double yield = group.plastic.yield;
    if (!(m.hardening > 0)) return yield;
    const double cap = m.toughness == kNever ? kNever : std::max(yield, kHardeningCap * m.toughness);
    return std::min(yield + m.hardening * excess.gamma * excess.size, cap);
}

// P of the factors, its principal stretches brought to det 1 and within the ratio.
Mat3 stored_factor(const RightFactors& factors, size_t i) {
    Vec3 p(factors.principal[0][i], factors.principal[1][i], factors.principal[2][i]);
    p /= math::cbrt(p.prod());
    if (const double ratio = p.maxCoeff() / p.minCoeff(); ratio > kMaxPlasticRatio) {
        const double power = math::log(kMaxPlasticRatio) / math::log(ratio);
        for (double& stretch : p) stretch = math::pow(stretch, power);
    }
    Mat3 U;
    for (size_t k = 0; k < 9; ++k) U.data()[k] = factors.directions[k][i];
    return U * p.asDiagonal() * U.transpose();
}

}  // namespace

double yield_strain(const SimulationMesh& rest, size_t particle, const Material& body) {
    return body.yield * (rest.yield_factor.empty() ? 1.0 : rest.yield_factor[particle]);
}

void flow(std::span<FlowingGroup> groups, double h, const StretchKernels& kernels,
          std::array<FlowResult, 4>& o_results) {
    std::array<Excess, 4> excesses;
    PrincipalLanes flowed = {};
    const double* before[4];
    bool any = false;
    for (size_t i = 0; i < 4; ++i) {
        const FlowingGroup& group = groups[std::min(i, groups.size() - 1)];  // beside fewer than four, again
        before[i] = group.plastic.F_P.data();
        excesses[i] = excess_strain(group, h);
        o_results[i] = {group.stretch.log_strain - excesses[i].flowed, Quat::Identity(), excesses[i].gamma > 0};
        any = any || o_results[i].flowed;
        for (int k = 0; k < 3; ++k) flowed.stretch[k][i] = math::exp(excesses[i].flowed(k));
        for (size_t k = 0; k < 9; ++k) flowed.directions[k][i] = group.stretch.directions.data()[k];
    }
    if (!any) return;

    RightFactors factors;
    kernels.factor(flowed, before, factors);
    for (size_t i = 0; i < groups.size(); ++i) {
        if (!o_results[i].flowed) continue;
        Mat3 Q;
        for (size_t k = 0; k < 9; ++k) Q.data()[k] = factors.Q[k][i];
        o_results[i].spin = Quat(Q).normalized();
        groups[i].plastic.F_P = stored_factor(factors, i);
        groups[i].plastic.yield = hardened(groups[i], excesses[i]);
    }
}

}  // namespace sunder
