#include "solver/material/bending_flow.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "solver/data/math_functions.h"
#include "solver/matching/plane_matrices.h"
#include "solver/material/plasticity.h"

namespace sunder {
namespace {

void harden(const Material& m, double flowed, double& io_yield) {
    if (!(m.hardening > 0) || flowed == 0) return;
    const double cap = m.toughness == kNever ? kNever : std::max(io_yield, kHardeningCap * m.toughness);
    io_yield = std::min(io_yield + m.hardening * flowed, cap);
}

// F_P of a flow in the plane of axes i and j, with what keeps its volume. Whether it takes all of it.
bool stretch_for_good(const BendingShape& s, int i, int j, const Mat2& flowed, Mat3& io_F_P) {
    const Mat3 own = s.axes.transpose() * io_F_P * s.axes;
    Mat2 before;
    before << own(i, i), own(i, j), own(j, i), own(j, j);
    const Mat2 after = function_of(flowed, [](double x) { return math::exp(x); }) * before;
    const Mat2 squared = after.transpose() * after;
    const double most = std::sqrt(kMaxPlasticRatio), least = 1 / most;
    const Mat2 right = function_of(squared, [&](double x) { return std::clamp(std::sqrt(x), least, most); });
    Mat3 now = Mat3::Zero();
    const int n = 3 - i - j;
    now(i, i) = right(0, 0), now(j, j) = right(1, 1), now(i, j) = now(j, i) = right(0, 1);
    now(n, n) = 1 / right.determinant();
    io_F_P = s.axes * now * s.axes.transpose();
    const double squares = squared.trace(), product = squared.determinant();  // of both stretches within bounds
    return squares <= most * most + product / (most * most) && product >= least * least * (squares - least * least);
}

// The same of a flow in all directions.
bool stretch_for_good(const Mat3& axes, const Mat3& flowed, Mat3& io_F_P) {
    const Eigen::SelfAdjointEigenSolver<Mat3> of(flowed);
    const Mat3 by = axes * of.eigenvectors();
    const Mat3 after =
        by * of.eigenvalues().unaryExpr([](double e) { return math::exp(e); }).asDiagonal() * by.transpose() * io_F_P;
    const Eigen::SelfAdjointEigenSolver<Mat3> squared(after.transpose() * after);
    const double volume = math::cbrt(std::sqrt(squared.eigenvalues().prod()));
    const double most = std::sqrt(kMaxPlasticRatio);
    bool is_taken = true;
    Vec3 right;
    for (int i = 0; i < 3; ++i) {
        right[i] = std::sqrt(squared.eigenvalues()[i]) / volume;
        is_taken &= right[i] <= most && right[i] >= 1 / most;
        right[i] = std::clamp(right[i], 1 / most, most);
    }
    right /= math::cbrt(right.prod());
    io_F_P = squared.eigenvectors() * right.asDiagonal() * squared.eigenvectors().transpose();
    return is_taken;
}

}  // namespace

FacePrincipal principal_of(const BendingShape& s, const Mat3& strain) {
    if (s.rank == 1) return {strain.diagonal(), s.axes};
    if (s.rank == 3) {
        const Eigen::SelfAdjointEigenSolver<Mat3> of(strain);
        return {of.eigenvalues(), s.axes * of.eigenvectors()};
    }
    const int n = s.normal, i = (n + 1) % 3, j = (n + 2) % 3;
    Mat2 in_plane;
    in_plane << strain(i, i), strain(i, j), strain(i, j), strain(j, j);
    const PlaneEigen of(in_plane);
    const double c = of.direction[0], sine = of.direction[1];
    FacePrincipal out;
    out.strain = {of.high, of.low, strain(n, n)};
    out.directions.col(0) = c * s.axes.col(i) + sine * s.axes.col(j);
    out.directions.col(1) = c * s.axes.col(j) - sine * s.axes.col(i);
    out.directions.col(2) = s.axes.col(n);
    return out;
}

double flowing_share(const Material& material, double h) { return -math::expm1(-material.flow_rate * h); }

BentFlow flow_bending(const BendingShape& s, const BentShape& group, const Unexplained& rest, const Material& material,
                      double h, BendingPlasticity& io) {
    SectionStrain strain = section_strain(s, group, io.K_P);
    const SectionFlow flow =
        flow_section(s, strain, io.remainder, rest, io.yield, h > 0 ? flowing_share(material, h) : 0);
    BentFlow out;
    static_cast<Yielding&>(out) = flow;
    if (out.flows()) {
        const LayerStrain kept = remainder_of(s, flow);
        for (size_t n = 0; n < kept.size(); ++n) io.remainder[n] += kept[n];
        io.K_P += flow.flowed.K;
        const Mat3& e = flow.flowed.stretch;
        if (s.rank == 3) {
            out.is_taken = stretch_for_good(s.axes, e, io.F_P);
        } else {
            Mat2 drawn;
            const bool is_rod = s.rank == 1;
            const int i = is_rod ? s.axis : (s.normal + 1) % 3, j = (i + 1) % 3;
            if (is_rod)  // along and, half as much, across
                drawn << e(i, i), 0, 0, -0.5 * e(i, i);
            else
                drawn << e(i, i), e(i, j), e(i, j), e(j, j);
            out.is_taken = stretch_for_good(s, i, j, drawn, io.F_P);
        }
        harden(material, flow.hardening, io.yield);
        strain.stretch -= e, strain.K -= flow.flowed.K;
    }
    find_face_strains(s, strain, io.remainder, io.yield, out.faces);
    return out;
}

}  // namespace sunder
