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

// A box of a body that has several of them through its thickness.
struct Places {
    static constexpr int kCount = 4;
    const BendingShape& s;
    double kappa[3][3];  // across each axis n: ii, jj, ij of the two after it

    Places(const BendingShape& shape, const Mat3& K) : s(shape) {
        for (int n = 0; n < 3; ++n) {
            const int i = (n + 1) % 3, j = (n + 2) % 3;
            kappa[n][0] = K(j, i), kappa[n][1] = -K(i, j), kappa[n][2] = 0.5 * (K(j, j) - K(i, i));
        }
    }
    // Every other corner, so that sum w y_n y_m = t_n^2 / 12 where n is m, else 0.
    static Vec3 corner(const BendingShape& s, int place) {
        const Vec3 sign(place & 2 ? -1 : 1, place == 1 || place == 2 ? -1 : 1, place & 1 ? -1 : 1);
        return s.extent.cwiseProduct(sign) / std::sqrt(12.0);
    }
    // By bending alone: of each axis as in a layer of a sheet, in plane stress.
    Mat3 strain(const Vec3& y) const {
        Mat3 e = Mat3::Zero();
        for (int n = 0; n < 3; ++n) {
            const int i = (n + 1) % 3, j = (n + 2) % 3;
            e(i, i) += y[n] * kappa[n][0], e(j, j) += y[n] * kappa[n][1];
            e(i, j) += y[n] * kappa[n][2], e(j, i) += y[n] * kappa[n][2];
            e(n, n) -= s.nu / (1 - s.nu) * y[n] * (kappa[n][0] + kappa[n][1]);
        }
        return e;
    }
};

Mat3 place_of(const LayerStrain& layers, int place) {
    const double* p = layers.data() + 6 * place;
    return Mat3{{p[0], p[3], p[4]}, {p[3], p[1], p[5]}, {p[4], p[5], p[2]}};
}

void put_place(const Mat3& m, int place, LayerStrain& o_layers) {
    const Sym3 six = to_sym(m);
    std::ranges::copy(six, o_layers.begin() + 6 * place);
}

// The largest of a deviator's eigenvalues is no more than this share of its norm.
constexpr double kOfNorm = 0.816496580927726;  // sqrt(2/3)

// The largest eigenvalue of the deviator, by size; or, where it is no more than `least`, something that is not either.
double largest_deviator(const Mat3& strain, double least = 0) {
    const double mean = strain.trace() / 3;
    const Mat3 d = strain - mean * Mat3::Identity();
    const double norm2 = d.squaredNorm();
    if (kOfNorm * kOfNorm * norm2 <= least * least) return 0;
    // Of 2 p cos(phi + 2 pi k / 3) one is 2 p cos(phi), phi from 0 to pi / 3, and one -2 p cos(pi / 3 - phi).
    const double p = std::sqrt(norm2 / 6), cosine = std::clamp(0.5 * d.determinant() / (p * p * p), -1.0, 1.0);
    return 2 * p * math::cos(math::acos(std::abs(cosine)) / 3);
}

SectionFlow flow_box(const BendingShape& s, const SectionStrain& strain, const LayerStrain& remainder,
                     const Unexplained& rest, double yield, double rate_share) {
    const Places places(s, strain.K);
    SectionFlow out;
    Mat3 moment[3] = {Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};
    for (int place = 0; place < Places::kCount; ++place) {
        const Vec3 y = Places::corner(s, place);
        const Mat3 e = strain.stretch + places.strain(y) - place_of(remainder, place);
        const double size = with_rest(largest_deviator(e), s, rest, 1);
        if (!(size > yield)) continue;
        const double share = rate_share * (size - yield) / size;
        const Mat3 flowed = share * (e - e.trace() / 3 * Mat3::Identity());
        put_place(flowed, place, out.layers);
        out.flowed.stretch += flowed / Places::kCount;
        for (int n = 0; n < 3; ++n) moment[n] += y[n] / Places::kCount * flowed;
        add_layer(share, size, 1, Places::kCount, out);
    }
    for (int n = 0; n < 3; ++n) {
        const int i = (n + 1) % 3, j = (n + 2) % 3;
        const Mat3 kappa = 12 / (s.extent[n] * s.extent[n]) * moment[n];
        out.flowed.K(j, i) = kappa(i, i), out.flowed.K(i, j) = -kappa(j, j);
        // Twists about three axes are differences of three numbers: their sum is 0, and two thirds of each are its own.
        out.flowed.K(j, j) += 2.0 / 3 * kappa(i, j), out.flowed.K(i, i) -= 2.0 / 3 * kappa(i, j);
    }
    return out;
}

// Whether the largest deviator of any layer may lie above the yield surface: by norms, which are no smaller.
bool may_flow(const BendingShape& s, double stretch, const Mat3& K, const LayerStrain& remainder,
              const Unexplained& rest, double yield) {
    const double half = 0.5 * (s.rank == 2 ? s.extent[s.normal] : s.extent.norm());
    double kept = 0;
    for (const double number : remainder) kept = std::max(kept, std::abs(number));
    const double most = stretch + half * K.norm() + 2 * kept;
    return with_rest(std::max(1.0, 2.0 / 3 * (1 + s.nu) / (1 - s.nu)) * most, s, rest, 6) > yield;
}

}  // namespace

SectionStrain section_strain(const BendingShape& s, const BentShape& group, const Mat3& K_P) {
    const Mat3 stretch = unstrained(s) + group.R.transpose() * group.F;
    SectionStrain strain;
    strain.K = group.K - K_P;
    if (s.rank == 1) {
        strain.stretch(s.axis, s.axis) = log_of(stretch(s.axis, s.axis));
    } else if (s.rank == 3) {
        const Eigen::SelfAdjointEigenSolver<Mat3> of(0.5 * (stretch + stretch.transpose()));
        strain.stretch =
            of.eigenvectors() * of.eigenvalues().unaryExpr(&log_of).asDiagonal() * of.eigenvectors().transpose();
    } else {
        const Plane plane(s);
        strain.stretch = plane.in_space(function_of(plane.in_plane(stretch), log_of));
    }
    return strain;
}

void find_face_strains(const BendingShape& s, const SectionStrain& strain, const LayerStrain& remainder, double yield,
                       FaceStrains& o_faces) {
    o_faces.n = 0;
    if (s.rank == 1) {
        const Fibres fibres(s);
        for (int fibre = kFibres; fibre < kFibres + 4; ++fibre) {
            const double e = fibres.strain(strain, fibre) - remainder[static_cast<size_t>(fibre)];
            Mat3& all = o_faces.strain[o_faces.n++];
            all.setZero();
            all(fibres.a, fibres.a) = e, all(fibres.i, fibres.i) = all(fibres.k, fibres.k) = -s.nu * e;
        }
        return;
    }
    if (s.rank == 2) {
        const Plane plane(s);
        for (int layer = kLayers; layer < kLayers + 2; ++layer) {
            const Layer of(plane.in_plane(strain.stretch) + plane.height(layer) * plane.curvature(strain.K) -
                               layer_of(remainder, layer),
                           s.nu);
            Mat3& all = o_faces.strain[o_faces.n++];
            all = plane.in_space(of.strain);
            all(s.normal, s.normal) = of.across;
        }
        return;
    }
    const Places places(s, strain.K);
    double most = yield;
    for (int place = 0; place < Places::kCount; ++place)
        most = std::max(most, largest_deviator(strain.stretch + places.strain(Places::corner(s, place)) -
                                               place_of(remainder, place)));
    for (int n = 0; n < 3; ++n)
        for (const double side : {-0.5, 0.5}) {
            Mat3& e = o_faces.strain[o_faces.n++];
            e = strain.stretch + places.strain(side * s.extent[n] * Vec3::Unit(n));
            const double size = largest_deviator(e), mean = e.trace() / 3;
            if (size > most) e = most / size * (e - mean * Mat3::Identity()) + mean * Mat3::Identity();
        }
}

LayerStrain remainder_of(const BendingShape& s, const SectionFlow& flow) {
    LayerStrain left = flow.layers;
    if (s.rank == 1) {
        const Fibres fibres(s);
        for (int fibre = 0; fibre < kFibres + 4; ++fibre)
            left[static_cast<size_t>(fibre)] -= fibres.strain(flow.flowed, fibre);
        return left;
    }
    if (s.rank == 3) {
        const Places places(s, flow.flowed.K);
        for (int place = 0; place < Places::kCount; ++place)
            put_place(place_of(flow.layers, place) - flow.flowed.stretch - places.strain(Places::corner(s, place)),
                      place, left);
        return left;
    }
    const Plane plane(s);
    const Mat2 mean = plane.in_plane(flow.flowed.stretch), bent = plane.curvature(flow.flowed.K);
    for (int layer = 0; layer < kLayers + 2; ++layer)
        put_layer(layer_of(flow.layers, layer) - mean - plane.height(layer) * bent, layer, left);
    return left;
}

bool may_flow(const BendingShape& s, const BentShape& group, const Mat3& K_P, const LayerStrain& remainder,
              const Unexplained& rest, double yield) {
    const Mat3 stretch = unstrained(s) + group.R.transpose() * group.F;
    const double off = (stretch - Mat3::Identity()).norm();
    return off >= 0.5 || may_flow(s, off / (1 - off), group.K - K_P, remainder, rest, yield);
}

SectionFlow flow_section(const BendingShape& s, const SectionStrain& strain, const LayerStrain& remainder,
                         const Unexplained& rest, double yield, double share) {
    if (!(share > 0) || !may_flow(s, strain.stretch.norm(), strain.K, remainder, rest, yield)) return {};
    const auto flow = s.rank == 1 ? flow_rod : s.rank == 2 ? flow_sheet : flow_box;
    return flow(s, strain, remainder, rest, yield, share);
}

}  // namespace sunder
