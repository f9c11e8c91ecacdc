// The best separating direction of an ellipsoid and a box, a segment or a point (two ellipsoids: ascent_kernels.cpp).
//
// For any unit n (from b to a) the slab between the two supporting planes is a lower bound of the gap,
//
//     f(n) = n . d - h(n) - sum_i e_i |n_i|,      h(n) = sqrt(n^T M n),  M = R diag(r^2) R^T,
//
// d = center_a - center_b, and its maximum over the sphere is the gap itself; where the solids overlap it is minus
// the least translation that parts them (Cameron & Culley 1986). The last term is the support of a box with half
// extents e around b (a segment or a point when some e vanish): it has kinks at n_i = 0, where faces and edges of
// the box are. Where f > 0 every local maximum is the global one, since f is concave and positively homogeneous.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "solver/data/math.h"

namespace sunder::detail {

/// M of an ellipsoid: its support function is sqrt(n^T M n), m2.
inline Mat3 support_matrix(const Mat3& axes, const Vec3& radii) {
    const Mat3 scaled = axes * radii.asDiagonal();
    return scaled * scaled.transpose();
}

/// `kKinks`: b is a box (e), and everything is given in its frame; else a point.
template <bool kKinks>
struct SupportGap {
    Vec3 d;    // center_a - center_b, m
    Mat3 M_a;  // m2
    Vec3 e;    // half extents, m, >= 0

    struct Sample {
        Vec3 n;          // unit
        Vec3 s_a;        // support point of a along n, from its centre
        double h_a = 0;  // support value
        double f = 0;    // the bound, m
    };

    Sample at(const Vec3& n) const {
        Sample s;
        s.n = n;
        const Vec3 Mn_a = M_a * n;
        s.h_a = std::sqrt(std::max(n.dot(Mn_a), kTiny));
        s.s_a = Mn_a / s.h_a;
        s.f = n.dot(d) - s.h_a;
        if constexpr (kKinks) s.f -= e.dot(n.cwiseAbs());
        return s;
    }

    /// Climbs from `n` (unit) by Riemannian Newton steps with backtracking; never ends lower than it began.
    Sample ascend(const Vec3& n) const {
        Sample s = at(n);
        for (int k = 0; k < kMaxSteps; ++k)
            if (!step(s)) break;
        return s;
    }

private:
    static constexpr double kTiny = 1e-300;          // keeps 0/0 out when a radius underflows
    static constexpr int kMaxSteps = 20;             // 3-5 are usual; 50:1 ellipsoids from a bad start need about 12
    static constexpr double kGainTolerance = 1e-10;  // of the support value: stop when a step promises less

    /// One accepted step; false when nothing is left to gain.
    bool step(Sample& io_s) const {
        const Sample& s = io_s;
        // At a kink the one-sided slopes decide: stuck to it when both fall, free on the side that rises otherwise.
        Vec3 side = Vec3::Zero();  // sign of each free component
        bool fixed[3] = {false, false, false};
        Vec3 G = d - s.s_a;  // gradient of f on the smooth side
        int n_fixed = 0;
        if constexpr (kKinks) {
            for (int i = 0; i < 3; ++i) {
                if (e[i] <= 0) continue;
                if (s.n[i] == 0) {
                    fixed[i] = std::abs(G[i]) <= e[i];
                    side[i] = G[i] > 0 ? 1 : -1;
                } else {
                    side[i] = s.n[i] > 0 ? 1 : -1;
                }
                if (fixed[i]) {
                    G[i] = 0;
                    ++n_fixed;
                } else {
                    G[i] -= side[i] * e[i];
                }
            }
            if (n_fixed >= 2) return false;  // a face normal, and no side of it rises
        }

        const auto hessian = [&](const Vec3& u, const Vec3& v) {  // -d2f along the sphere
            return u.dot(M_a * v) / s.h_a - u.dot(s.s_a) * v.dot(s.s_a) / s.h_a;
        };
        const double tolerance = kGainTolerance * s.h_a;
        Vec3 newton, steepest;  // tangent steps, rad
        double promised = 0;
        if (n_fixed == 1) {
            Vec3 axis = Vec3::Zero();
            for (int i = 0; i < 3; ++i)
                if (fixed[i]) axis[i] = 1;
            const Vec3 t = axis.cross(s.n);
            const double curvature = hessian(t, t), r = t.dot(G);
            double a = curvature + s.f;
            if (a < 1e-3 * curvature) a = std::max(std::abs(a), 1e-3 * curvature + kTiny);
            newton = t * (r / a);
            steepest = t * (r / (curvature + std::abs(s.f) + kTiny));
            promised = 0.5 * r * r / a;
        } else {
            Vec3 t1, t2;
            tangents(s.n, t1, t2);
            const double h11 = hessian(t1, t1), h12 = hessian(t1, t2), h22 = hessian(t2, t2);
            const double r1 = t1.dot(G), r2 = t2.dot(G);
            const double scale = h11 + h22 + std::abs(s.f) + kTiny;
            double x1, x2;
            promised = newton_step(h11 + s.f, h12, h22 + s.f, r1, r2, scale, x1, x2);
            newton = t1 * x1 + t2 * x2;
            steepest = (t1 * r1 + t2 * r2) / scale;
        }
        const double length = newton.norm();
        if (length > 1) newton /= length;  // 45 degrees at most
        if (!search(newton, side, io_s) && !search(steepest, side, io_s)) return false;
        return promised > tolerance;
    }

    /// Solves [a11 a12; a12 a22] x = r, with |eigenvalues| where the matrix is not positive definite (solids that
    /// overlap deeply), and off a saddle along its rising direction. Returns the gain that the model promises.
    static double newton_step(double a11, double a12, double a22, double r1, double r2, double scale, double& x1,
                              double& x2) {
        const double det = a11 * a22 - a12 * a12;
        if (a11 > 0 && det > 1e-10 * (a11 + a22) * (a11 + a22)) {
            x1 = (a22 * r1 - a12 * r2) / det;
            x2 = (a11 * r2 - a12 * r1) / det;
            return 0.5 * (x1 * r1 + x2 * r2);
        }
        const double mean = 0.5 * (a11 + a22), half = 0.5 * (a11 - a22);
        const double spread = std::sqrt(half * half + a12 * a12);
        double c = 1, s = 0;  // eigenvector of the larger eigenvalue
        if (spread > 0) {
            c = half >= 0 ? half + spread : std::abs(a12);
            s = half >= 0 ? a12 : std::copysign(spread - half, a12);
            const double length = std::sqrt(c * c + s * s);
            c /= length;
            s /= length;
        }
        const double lambda[2] = {mean + spread, mean - spread};
        const double r[2] = {c * r1 + s * r2, c * r2 - s * r1};
        double y[2], gain = 0;
        for (int k = 0; k < 2; ++k) {
            y[k] = r[k] / std::max(std::abs(lambda[k]), 1e-3 * scale);
            if (lambda[k] < -1e-9 * scale && std::abs(y[k]) < 0.1) y[k] = r[k] < 0 ? -0.1 : 0.1;
            gain += r[k] * y[k] - 0.5 * lambda[k] * y[k] * y[k];
        }
        x1 = c * y[0] - s * y[1];
        x2 = s * y[0] + c * y[1];
        return gain;
    }

    /// Backtracks along a tangent step until f rises; components that would cross a kink stop at it.
    bool search(const Vec3& tangent, const Vec3& side, Sample& io_s) const {
        double alpha = 1;
        for (int k = 0; k < 10; ++k, alpha *= 0.35) {
            Vec3 n = io_s.n + alpha * tangent;
            if constexpr (kKinks)
                for (int i = 0; i < 3; ++i)
                    if (e[i] > 0 && n[i] * side[i] < 0) n[i] = 0;
            const double length = n.norm();
            if (!(length > 1e-9)) continue;
            const Sample next = at(n / length);
            if (next.f > io_s.f) {
                io_s = next;
                return true;
            }
        }
        return false;
    }

    /// Orthonormal tangents without a branch on which axis is smallest (Duff et al. 2017).
    static void tangents(const Vec3& n, Vec3& t1, Vec3& t2) {
        const double sign = std::copysign(1.0, n.z()), a = -1 / (sign + n.z()), b = n.x() * n.y() * a;
        t1 = Vec3(1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x());
        t2 = Vec3(b, sign + n.y() * n.y() * a, -n.y());
    }
};

/// Overlap, as a share of the support, from which other maxima are looked for. Of 22 000 random pairs of ellipsoids
/// that overlap less (aspect up to 10), none had a better one than the one above the centre line.
constexpr double kShallow = 0.1;

/// Climbs from `first` and, where the solids overlap deeply (f may have several maxima then), also from the kClimbs
/// best of `candidates`, each flipped to the side of a. Directions need not be unit; null ones are passed over.
template <int kClimbs = 3, class Gap, size_t kCandidates>
typename Gap::Sample best_direction(const Gap& gap, const Vec3& first,
                                    const std::array<Vec3, kCandidates>& candidates) {
    typename Gap::Sample best;
    bool found = false;
    const double first_length = first.norm();
    if (first_length > 0 && std::isfinite(first_length)) {
        best = gap.ascend(first / first_length);
        if (best.f > -kShallow * best.h_a) return best;
        found = true;
    }
    Vec3 start[kClimbs];
    double value[kClimbs];
    int n_starts = 0;
    for (const Vec3& candidate : candidates) {
        const double length = candidate.norm();
        if (!(length > 0)) continue;
        const Vec3 n = candidate / (candidate.dot(gap.d) < 0 ? -length : length);
        const double f = gap.at(n).f;
        int slot = n_starts < kClimbs ? n_starts++ : kClimbs;
        while (slot > 0 && f > value[slot - 1]) {
            if (slot < kClimbs) {
                start[slot] = start[slot - 1];
                value[slot] = value[slot - 1];
            }
            --slot;
        }
        if (slot < kClimbs) {
            start[slot] = n;
            value[slot] = f;
        }
    }
    for (int k = 0; k < n_starts; ++k) {
        const typename Gap::Sample s = gap.ascend(start[k]);
        if (!found || s.f > best.f) best = s;
        found = true;
    }
    return best;
}

}  // namespace sunder::detail
