#include "solver/matching/section_flow.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "solver/data/math_functions.h"
#include "solver/matching/optimal_stretch.h"
#include "solver/matching/plane_matrices.h"

namespace sunder {
namespace {

constexpr int kLayers = 5;                            // with weight
constexpr double kOutermost = 2 / 4.898979485566356;  // of the thickness, 2 / sqrt(24): layers lie at (i - 2) / 2 of it
constexpr int kFibres = kLayers * kLayers;

double log_of(double stretch) { return math::log(std::clamp(stretch, kSmallestStretch, kLargestStretch)); }

// The largest deviator of a uniaxial strain, over that strain.
double deviator_of_uniaxial(const BendingShape& s) { return 2.0 / 3 * (1 + s.nu); }

// The deviator of a layer and of what no bent shape explains, which bends `far` times its mean there.
double with_rest(double deviator, const BendingShape& s, const Unexplained& rest, double far) {
    const double to_deviator = deviator_of_uniaxial(s);
    return std::sqrt(deviator * deviator + to_deviator * to_deviator * (rest.stretch + far * rest.bend));
}

// What F leaves out, where members lie askew to the fragment's axes.
Mat3 unstrained(const BendingShape& s) { return Mat3::Identity() - s.spanned; }

// A sheet's axes in its plane, and its layers.
struct Plane {
    int i, j;
    double t;

    explicit Plane(const BendingShape& s) : i((s.normal + 1) % 3), j((s.normal + 2) % 3), t(s.extent[s.normal]) {}
    Mat2 in_plane(const Mat3& m) const {
        Mat2 of;
        of << m(i, i), 0.5 * (m(i, j) + m(j, i)), 0.5 * (m(i, j) + m(j, i)), m(j, j);
        return of;
    }
    Mat3 in_space(const Mat2& m) const {
        Mat3 of = Mat3::Zero();
        of(i, i) = m(0, 0), of(j, j) = m(1, 1), of(i, j) = of(j, i) = m(0, 1);
        return of;
    }
    Mat2 curvature(const Mat3& K) const {
        const double twist = 0.5 * (K(j, j) - K(i, i));
        Mat2 kappa;
        kappa << K(j, i), twist, twist, -K(i, j);
        return kappa;
    }
    Mat3 as_K(const Mat2& kappa) const {
        Mat3 K = Mat3::Zero();
        K(j, i) = kappa(0, 0), K(i, j) = -kappa(1, 1), K(j, j) = kappa(0, 1), K(i, i) = -kappa(0, 1);
        return K;
    }
    double height(int layer) const {
        return layer < kLayers ? t * kOutermost * (0.5 * layer - 1) : t * (layer == kLayers ? -0.5 : 0.5);
    }
};

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

Mat2 layer_of(const LayerStrain& layers, int layer) {
    const double* p = layers.data() + 3 * layer;
    Mat2 m;
    m << p[0], p[2], p[2], p[1];
    return m;
}

void put_layer(const Mat2& m, int layer, LayerStrain& o_layers) {
    double* p = o_layers.data() + 3 * layer;
    p[0] = m(0, 0), p[1] = m(1, 1), p[2] = m(0, 1);
}

// One of `layers` alike.
void add_layer(double share, double size, double far, int layers, SectionFlow& io_flow) {
    io_flow.hardening += share * size / layers;
    io_flow.stretch_share += share / layers, io_flow.bend_share += far * share / layers;
}

SectionFlow flow_sheet(const BendingShape& s, const SectionStrain& strain, const LayerStrain& remainder,
                       const Unexplained& rest, double yield, double rate_share) {
    const Plane plane(s);
    const Mat2 membrane = plane.in_plane(strain.stretch), kappa = plane.curvature(strain.K);
    Mat2 mean = Mat2::Zero(), moment = mean;
    SectionFlow out;
    for (int layer = 0; layer < kLayers + 2; ++layer) {
        const double z = plane.height(layer), far = 12 * z * z / (plane.t * plane.t);  // 1 in the mean
        const Layer of(membrane + z * kappa - layer_of(remainder, layer), s.nu);
        const double size = with_rest(of.deviator(), s, rest, far);
        if (!(size > yield)) continue;
        const double share = rate_share * (size - yield) / size;
        const Mat2 flowed = share * (of.strain - of.mean * Mat2::Identity());
        put_layer(flowed, layer, out.layers);
        if (layer >= kLayers) continue;
        mean += flowed / kLayers, moment += z / kLayers * flowed;
        add_layer(share, size, far, kLayers, out);
    }
    out.flowed = {plane.in_space(mean), plane.as_K(12 / (plane.t * plane.t) * moment)};
    return out;
}

// A rod's axes across it, and its fibres.
struct Fibres {
    int a, i, k;
    Vec3 extent;
    struct Place {
        double y, z;
    };

    explicit Fibres(const BendingShape& s) : a(s.axis), i((a + 1) % 3), k((a + 2) % 3), extent(s.extent) {}
    Place place(int fibre) const {  // 25 with weight, then the corners
        if (fibre >= kFibres)
            return {(fibre & 1 ? 0.5 : -0.5) * extent[i], ((fibre - kFibres) & 2 ? 0.5 : -0.5) * extent[k]};
        const int row = fibre / kLayers;
        return {extent[i] * kOutermost * (0.5 * (fibre % kLayers) - 1), extent[k] * kOutermost * (0.5 * row - 1)};
    }
    double strain(const SectionStrain& of, int fibre) const {
        const Place at = place(fibre);
        return of.stretch(a, a) + at.z * of.K(i, a) - at.y * of.K(k, a);
    }
};

SectionFlow flow_rod(const BendingShape& s, const SectionStrain& strain, const LayerStrain& remainder,
                     const Unexplained& rest, double yield, double rate_share) {
    const Fibres fibres(s);
    const int a = fibres.a, i = fibres.i, k = fibres.k;
    const double to_deviator = deviator_of_uniaxial(s);
    double about_i = 0, about_k = 0;
    SectionFlow out;
    for (int fibre = 0; fibre < kFibres + 4; ++fibre) {
        const Fibres::Place at = fibres.place(fibre);
        const double y = at.y / s.extent[i], z = at.z / s.extent[k], far = 6 * (y * y + z * z);  // 1 in the mean
        const double e = fibres.strain(strain, fibre) - remainder[static_cast<size_t>(fibre)];
        const double size = with_rest(to_deviator * std::abs(e), s, rest, far);
        if (!(size > yield)) continue;
        const double share = rate_share * (size - yield) / size, flowed = share * to_deviator * e;
        out.layers[static_cast<size_t>(fibre)] = flowed;
        if (fibre >= kFibres) continue;
        out.flowed.stretch(a, a) += flowed / kFibres;
        add_layer(share, size, far, kFibres, out);
        about_i += flowed * at.z / kFibres, about_k -= flowed * at.y / kFibres;
    }
    out.flowed.K(i, a) = 12 / (s.extent[k] * s.extent[k]) * about_i;
    out.flowed.K(k, a) = 12 / (s.extent[i] * s.extent[i]) * about_k;
    return out;
}

// Whether the largest deviator of any layer may lie above the yield surface: by norms, which are no smaller.
bool may_flow(const BendingShape& s, const SectionStrain& strain, const LayerStrain& remainder, const Unexplained& rest,
              double yield) {
    const double half = 0.5 * (s.rank == 1 ? s.extent.norm() : s.extent[s.normal]);
    double kept = 0;
    for (const double number : remainder) kept = std::max(kept, std::abs(number));
    const double most = strain.stretch.norm() + half * strain.K.norm() + 2 * kept;
    return with_rest(std::max(1.0, 2.0 / 3 * (1 + s.nu) / (1 - s.nu)) * most, s, rest, 6) > yield;
}

}  // namespace

SectionStrain section_strain(const BendingShape& s, const BentGroup& group, const Mat3& K_P) {
    const Mat3 stretch = unstrained(s) + group.R.transpose() * group.F;
    SectionStrain strain;
    strain.K = group.K - K_P;
    if (s.rank == 1) {
        strain.stretch(s.axis, s.axis) = log_of(stretch(s.axis, s.axis));
    } else {
        const Plane plane(s);
        strain.stretch = plane.in_space(function_of(plane.in_plane(stretch), log_of));
    }
    return strain;
}

SectionLayers section_layers(const BendingShape& s) {
    return s.rank == 1 ? SectionLayers{kFibres + 4, kFibres} : SectionLayers{kLayers + 2, kLayers};
}

Mat3 layer_strain(const BendingShape& s, const SectionStrain& strain, const LayerStrain& remainder, size_t layer) {
    const int number = static_cast<int>(layer);
    Mat3 all = Mat3::Zero();
    if (s.rank == 1) {
        const Fibres fibres(s);
        const double e = fibres.strain(strain, number) - remainder[layer];
        all(fibres.a, fibres.a) = e, all(fibres.i, fibres.i) = all(fibres.k, fibres.k) = -s.nu * e;
        return all;
    }
    const Plane plane(s);
    const Layer of(
        plane.in_plane(strain.stretch) + plane.height(number) * plane.curvature(strain.K) - layer_of(remainder, number),
        s.nu);
    all = plane.in_space(of.strain);
    all(s.normal, s.normal) = of.across;
    return all;
}

LayerStrain remainder_of(const BendingShape& s, const SectionFlow& flow) {
    LayerStrain left = flow.layers;
    if (s.rank == 1) {
        const Fibres fibres(s);
        for (int fibre = 0; fibre < kFibres + 4; ++fibre)
            left[static_cast<size_t>(fibre)] -= fibres.strain(flow.flowed, fibre);
        return left;
    }
    const Plane plane(s);
    const Mat2 mean = plane.in_plane(flow.flowed.stretch), bent = plane.curvature(flow.flowed.K);
    for (int layer = 0; layer < kLayers + 2; ++layer)
        put_layer(layer_of(flow.layers, layer) - mean - plane.height(layer) * bent, layer, left);
    return left;
}

SectionFlow flow_section(const BendingShape& s, const SectionStrain& strain, const LayerStrain& remainder,
                         const Unexplained& rest, double yield, double share) {
    if (!(share > 0) || !may_flow(s, strain, remainder, rest, yield)) return {};
    return s.rank == 1 ? flow_rod(s, strain, remainder, rest, yield, share)
                       : flow_sheet(s, strain, remainder, rest, yield, share);
}

}  // namespace sunder
