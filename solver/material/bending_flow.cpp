#include "solver/material/bending_flow.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "solver/data/math_functions.h"
#include "solver/matching/optimal_stretch.h"
#include "solver/material/plasticity.h"

namespace sunder {
namespace {

using Mat2 = Eigen::Matrix2d;
using Vec2 = Eigen::Vector2d;

constexpr int kLayers = 5;                            // with weight
constexpr double kOutermost = 2 / 4.898979485566356;  // of the thickness, 2 / sqrt(24): layers lie at (i - 2) / 2 of it

double log_of(double stretch) { return math::log(std::clamp(stretch, kSmallestStretch, kLargestStretch)); }

// f of a symmetric matrix.
template <class F>
Mat2 function_of(const Mat2& m, const F& f) {
    // Closed form: eigenvalues mean +- radius.
    const double mean = 0.5 * m.trace(), half = 0.5 * (m(0, 0) - m(1, 1)), off = m(0, 1);
    const double radius = std::sqrt(half * half + off * off);
    if (radius == 0) return f(mean) * Mat2::Identity();
    Mat2 direction;  // of the larger eigenvalue minus that of the smaller
    direction << half / radius, off / radius, off / radius, -half / radius;
    const double high = f(mean + radius), low = f(mean - radius);
    return 0.5 * (high + low) * Mat2::Identity() + 0.5 * (high - low) * direction;
}

// Of the excess of a strain above the yield surface what flows in h seconds, as a share of its deviator.
double flowing_share(double size, double yield, const Material& material, double h) {
    if (!(size > yield)) return 0;
    return -math::expm1(-material.flow_rate * h) * (size - yield) / size;
}

// The largest deviator of a uniaxial strain, over that strain.
double deviator_of_uniaxial(const BendingShape& s) { return 2.0 / 3 * (1 + s.nu); }

// The deviator of a layer and of what no bent shape explains, which bends `far` times its mean there.
double with_rest(double deviator, const BendingShape& s, const Unexplained& rest, double far) {
    const double to_deviator = deviator_of_uniaxial(s);
    return std::sqrt(deviator * deviator + to_deviator * to_deviator * (rest.stretch + far * rest.bend));
}

void harden(const Material& m, double flowed, double& io_yield) {
    if (!(m.hardening > 0) || flowed == 0) return;
    const double cap = m.toughness == kNever ? kNever : std::max(io_yield, kHardeningCap * m.toughness);
    io_yield = std::min(io_yield + m.hardening * flowed, cap);
}

// F_P of a flow in the plane of axes i and j, with what keeps its volume.
void stretch_for_good(const BendingShape& s, int i, int j, const Mat2& flowed, Mat3& io_F_P) {
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
}

// A layer of a sheet: its strain in the plane.
struct Layer {
    Mat2 strain;
    double across = 0, mean = 0;  // strain along the normal, a third of the trace

    Layer(const Mat2& e, double nu) : strain(e), across(-nu / (1 - nu) * e.trace()) { mean = (e.trace() + across) / 3; }
    double deviator() const {
        const double half = 0.5 * (strain(0, 0) - strain(1, 1)), off = strain(0, 1);
        const double middle = 0.5 * strain.trace() - mean, radius = std::sqrt(half * half + off * off);
        return std::max(std::abs(middle) + radius, std::abs(across - mean));
    }
};

// What F leaves out, where members lie askew to the fragment's axes.
Mat3 unstrained(const BendingShape& s) { return Mat3::Identity() - s.spanned; }

Mat2 remainder_of(const LayerStrain& of, int layer) {
    const double* p = of.data() + 3 * layer;
    Mat2 m;
    m << p[0], p[2], p[2], p[1];
    return m;
}

BentFlow flow_sheet(const BendingShape& s, const BentGroup& group, const Unexplained& rest, const Material& material,
                    double h, BendingPlasticity& io) {
    const int n = s.normal, i = (n + 1) % 3, j = (n + 2) % 3;
    const double t = s.extent[n];
    const auto curvature = [&](const Mat3& K) {
        const double twist = 0.5 * (K(j, j) - K(i, i));
        Mat2 kappa;
        kappa << K(j, i), twist, twist, -K(i, j);
        return kappa;
    };
    const Mat3 stretch = unstrained(s) + group.R.transpose() * group.F;
    Mat2 in_plane;
    in_plane << stretch(i, i), 0.5 * (stretch(i, j) + stretch(j, i)), 0.5 * (stretch(i, j) + stretch(j, i)),
        stretch(j, j);
    const Mat2 membrane = function_of(in_plane, log_of);
    const Mat2 kappa = curvature(group.K - io.K_P);
    // Five with weight, then the two faces.
    const auto height = [&](int layer) {
        return layer < kLayers ? t * kOutermost * (0.5 * layer - 1) : t * (layer == kLayers ? -0.5 : 0.5);
    };
    Mat2 mean = Mat2::Zero(), moment = mean, flowed[kLayers + 2];
    double hardening = 0;
    BentFlow out;
    for (int layer = 0; layer < kLayers + 2; ++layer) {
        const Layer of(membrane + height(layer) * kappa - remainder_of(io.remainder, layer), s.nu);
        const double far = 12 * height(layer) * height(layer) / (t * t);  // 1 in the mean
        const double size = with_rest(of.deviator(), s, rest, far);
        const double share = h > 0 ? flowing_share(size, io.yield, material, h) : 0;
        flowed[layer] = share * (of.strain - of.mean * Mat2::Identity());
        if (layer >= kLayers) continue;
        mean += flowed[layer] / kLayers, moment += height(layer) / kLayers * flowed[layer];
        hardening += share * size / kLayers;
        out.stretch_share += share / kLayers, out.bend_share += far * share / kLayers;
    }
    out.flows = hardening > 0;
    const Mat2 bent = 12 / (t * t) * moment;
    if (out.flows) {
        for (int layer = 0; layer < kLayers + 2; ++layer) {
            const Mat2 kept = flowed[layer] - mean - height(layer) * bent;
            double* p = io.remainder.data() + 3 * layer;
            p[0] += kept(0, 0), p[1] += kept(1, 1), p[2] += kept(0, 1);
        }
        io.K_P(j, i) += bent(0, 0), io.K_P(i, j) -= bent(1, 1);
        io.K_P(j, j) += bent(0, 1), io.K_P(i, i) -= bent(0, 1);
        stretch_for_good(s, i, j, mean, io.F_P);
        harden(material, hardening, io.yield);
    }
    FaceStrains& faces = out.faces;
    for (int side = 0; side < 2; ++side) {
        const int layer = kLayers + side;
        const Layer of(membrane - mean + height(layer) * (kappa - bent) - remainder_of(io.remainder, layer), s.nu);
        Mat3& e = faces.strain[faces.n++];
        e.setZero();
        e(i, i) = of.strain(0, 0), e(j, j) = of.strain(1, 1), e(i, j) = e(j, i) = of.strain(0, 1), e(n, n) = of.across;
    }
    return out;
}

BentFlow flow_rod(const BendingShape& s, const BentGroup& group, const Unexplained& rest, const Material& material,
                  double h, BendingPlasticity& io) {
    constexpr int kFibres = kLayers * kLayers;
    const int a = s.axis, i = (a + 1) % 3, k = (a + 2) % 3;
    const Mat3 K = group.K - io.K_P;
    const double along = log_of((unstrained(s) + group.R.transpose() * group.F)(a, a));
    const double to_deviator = deviator_of_uniaxial(s);
    struct Fibre {
        double y, z;
    };
    const auto place = [&](int fibre) {  // 25 with weight, then the corners
        if (fibre >= kFibres)
            return Fibre{(fibre & 1 ? 0.5 : -0.5) * s.extent[i], ((fibre - kFibres) & 2 ? 0.5 : -0.5) * s.extent[k]};
        const int row = fibre / kLayers;
        return Fibre{s.extent[i] * kOutermost * (0.5 * (fibre % kLayers) - 1),
                     s.extent[k] * kOutermost * (0.5 * row - 1)};
    };
    const auto strain = [&](int fibre, double mean, const Mat3& curvature) {
        const Fibre at = place(fibre);
        return mean + at.z * curvature(i, a) - at.y * curvature(k, a) - io.remainder[static_cast<size_t>(fibre)];
    };
    double mean = 0, about_i = 0, about_k = 0, hardening = 0, flowed[kFibres + 4];
    BentFlow out;
    for (int fibre = 0; fibre < kFibres + 4; ++fibre) {
        const Fibre at = place(fibre);
        const double y = at.y / s.extent[i], z = at.z / s.extent[k], far = 6 * (y * y + z * z);  // 1 in the mean
        const double e = strain(fibre, along, K), size = with_rest(to_deviator * std::abs(e), s, rest, far);
        const double share = h > 0 ? flowing_share(size, io.yield, material, h) : 0;
        flowed[fibre] = share * to_deviator * e;
        if (fibre >= kFibres) continue;
        mean += flowed[fibre] / kFibres, hardening += share * size / kFibres;
        out.stretch_share += share / kFibres, out.bend_share += far * share / kFibres;
        about_i += flowed[fibre] * at.z / kFibres, about_k -= flowed[fibre] * at.y / kFibres;
    }
    about_i *= 12 / (s.extent[k] * s.extent[k]), about_k *= 12 / (s.extent[i] * s.extent[i]);
    out.flows = hardening > 0;
    Mat3 left = K;
    left(i, a) -= about_i, left(k, a) -= about_k;
    if (out.flows) {
        for (int fibre = 0; fibre < kFibres + 4; ++fibre) {
            const Fibre at = place(fibre);
            io.remainder[static_cast<size_t>(fibre)] += flowed[fibre] - mean - at.z * about_i + at.y * about_k;
        }
        io.K_P(i, a) += about_i, io.K_P(k, a) += about_k;
        Mat2 drawn = Mat2::Zero();  // along and, half as much, across
        drawn(0, 0) = mean, drawn(1, 1) = -0.5 * mean;
        stretch_for_good(s, a, i, drawn, io.F_P);
        harden(material, hardening, io.yield);
    }
    FaceStrains& faces = out.faces;
    for (int corner = 0; corner < 4; ++corner) {
        const double e = strain(kFibres + corner, along - mean, left);
        Mat3& of = faces.strain[faces.n++];
        of.setZero();
        of(a, a) = e, of(i, i) = of(k, k) = -s.nu * e;
    }
    return out;
}

}  // namespace

BentFlow flow_bending(const BendingShape& shape, const BentGroup& group, const Unexplained& rest,
                      const Material& material, double h, BendingPlasticity& io_plastic) {
    return shape.rank == 1 ? flow_rod(shape, group, rest, material, h, io_plastic)
                           : flow_sheet(shape, group, rest, material, h, io_plastic);
}

}  // namespace sunder
