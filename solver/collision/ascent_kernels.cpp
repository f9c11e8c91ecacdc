// The best separating direction of two ellipsoids, for four pairs at a time. For any unit n (from b to a) the slab
// between the two supporting planes is a lower bound of the gap,
//
//     f(n) = n . d - h_a(n) - h_b(n),      h(n) = sqrt(n^T M n),  M = R diag(r^2) R^T,
//
// d = center_a - center_b, and its maximum over the sphere is the gap itself; where the solids overlap it is minus the
// least translation that parts them (Cameron & Culley 1986). Where f > 0 every local maximum is the global one, since f
// is concave and positively homogeneous. Climbed by Riemannian Newton steps with backtracking, as in support_ascent.h.
// Compiled once for each instruction set (lanes.h).
#include "solver/collision/ascent_kernels.h"

#include "solver/lanes/lane_vectors.h"

namespace sunder {
namespace {

constexpr int kMaxSteps = 20;  // 3-5 are usual; 50:1 ellipsoids from a bad start need about 12
constexpr int kBacktracks = 10;
constexpr double kGainTolerance = 1e-10;  // of the support value: the last step is one that promises less
constexpr double kInfinity = __builtin_huge_val();

SUNDER_INLINE Sym load_sym(const double (&m)[6][4]) {
    return {load<Lanes>(m[0]), load<Lanes>(m[1]), load<Lanes>(m[2]),
            load<Lanes>(m[3]), load<Lanes>(m[4]), load<Lanes>(m[5])};
}
struct Sample {
    V3 n;            // unit
    V3 s_a, s_b;     // support points along n, from the centres
    Lanes h_a, h_b;  // support values
    Lanes f;         // the bound, m
};
SUNDER_INLINE Sample select_sample(LaneMask m, const Sample& yes, const Sample& no) {
    return {select3(m, yes.n, no.n),           select3(m, yes.s_a, no.s_a),       select3(m, yes.s_b, no.s_b),
            select<Lanes>(m, yes.h_a, no.h_a), select<Lanes>(m, yes.h_b, no.h_b), select<Lanes>(m, yes.f, no.f)};
}

struct Gap {
    V3 d;
    Sym M_a, M_b;
};

SUNDER_INLINE Sample sample_at(const Gap& g, V3 n) {
    Sample s;
    s.n = n;
    const V3 Mn_a = g.M_a * n, Mn_b = g.M_b * n;
    s.h_a = root(larger(dot(n, Mn_a), all(kTiny)));
    s.h_b = root(larger(dot(n, Mn_b), all(kTiny)));
    s.s_a = (all(1) / s.h_a) * Mn_a;
    s.s_b = (all(1) / s.h_b) * Mn_b;
    s.f = dot(n, g.d) - s.h_a - s.h_b;
    return s;
}

// Solves [a11 a12; a12 a22] x = r, with |eigenvalues| where the matrix is not positive definite (solids that overlap
// deeply), and off a saddle along its rising direction.
struct Step2 {
    Lanes x1, x2, promised;  // rad; the gain that the model promises, m
};
SUNDER_INLINE Step2 newton_step(Lanes a11, Lanes a12, Lanes a22, Lanes r1, Lanes r2, Lanes scale) {
    const Lanes det = a11 * a22 - a12 * a12, trace = a11 + a22;
    const LaneMask definite = (a11 > all(0)) & (det > all(1e-10) * trace * trace);
    const Lanes inverse = all(1) / select<Lanes>(definite, det, all(1));
    Step2 step;
    step.x1 = (a22 * r1 - a12 * r2) * inverse;
    step.x2 = (a11 * r2 - a12 * r1) * inverse;
    step.promised = all(0.5) * (step.x1 * r1 + step.x2 * r2);
    if (!any(~definite)) return step;

    const Lanes mean = all(0.5) * trace, half = all(0.5) * (a11 - a22), spread = root(half * half + a12 * a12);
    // Eigenvector of the larger eigenvalue.
    const LaneMask rising = ~(half < all(0));
    Lanes c = select<Lanes>(rising, half + spread, absolute(a12));
    Lanes s = select<Lanes>(rising, a12, select<Lanes>(a12 < all(0), half - spread, spread - half));
    const Lanes length = root(c * c + s * s);
    const LaneMask is_round = ~(length > all(kTiny));
    const Lanes over = all(1) / select<Lanes>(is_round, all(1), length);
    c = select<Lanes>(is_round, all(1), c * over), s = select<Lanes>(is_round, all(0), s * over);
    Lanes y[2], gain = all(0);
    const Lanes lambda[2] = {mean + spread, mean - spread}, r[2] = {c * r1 + s * r2, c * r2 - s * r1};
    for (int k = 0; k < 2; ++k) {
        y[k] = r[k] / larger(absolute(lambda[k]), all(1e-3) * scale);
        const LaneMask stuck = (lambda[k] < all(-1e-9) * scale) & (absolute(y[k]) < all(0.1));
        y[k] = select<Lanes>(stuck, select<Lanes>(r[k] < all(0), all(-0.1), all(0.1)), y[k]);
        gain = gain + (r[k] * y[k] - all(0.5) * lambda[k] * y[k] * y[k]);
    }
    step.x1 = select<Lanes>(definite, step.x1, c * y[0] - s * y[1]);
    step.x2 = select<Lanes>(definite, step.x2, s * y[0] + c * y[1]);
    step.promised = select<Lanes>(definite, step.promised, gain);
    return step;
}

// Backtracks along a tangent step until f rises, at most `tries` times, in the lanes of `io_searching`; clears there
// those that found.
SUNDER_INLINE void search(const Gap& g, V3 tangent, const Sample& from, int tries, Sample& io_best,
                          LaneMask& io_searching) {
    double alpha = 1;
    for (int k = 0; k < tries && any(io_searching); ++k, alpha *= 0.35) {
        const V3 n = from.n + all(alpha) * tangent;
        const Lanes length = root(dot(n, n));  // at least 1: steps are across n
        const Sample next = sample_at(g, (all(1) / length) * n);
        const LaneMask found = io_searching & (next.f > from.f);
        io_best = select_sample(found, next, io_best);
        io_searching = io_searching & ~found;
    }
}

// Climbs from `n` (unit); never ends lower than it began. Lanes that are done are left as they are.
SUNDER_INLINE Sample ascend(const Gap& g, V3 n) {
    Sample s = sample_at(g, n);
    LaneMask climbing = s.h_a > all(0);
    for (int k = 0; k < kMaxSteps && any(climbing); ++k) {
        const V3 G = g.d - s.s_a - s.s_b;  // gradient of f
        const auto [t1, t2] = tangents_of(s.n);

        // -d2f along the sphere
        const V3 Mt1_a = g.M_a * t1, Mt2_a = g.M_a * t2, Mt1_b = g.M_b * t1, Mt2_b = g.M_b * t2;
        const Lanes u1 = dot(t1, s.s_a), u2 = dot(t2, s.s_a), v1 = dot(t1, s.s_b), v2 = dot(t2, s.s_b);
        const Lanes over_a = all(1) / s.h_a, over_b = all(1) / s.h_b;
        const Lanes h11 = (dot(t1, Mt1_a) - u1 * u1) * over_a + (dot(t1, Mt1_b) - v1 * v1) * over_b;
        const Lanes h12 = (dot(t1, Mt2_a) - u1 * u2) * over_a + (dot(t1, Mt2_b) - v1 * v2) * over_b;
        const Lanes h22 = (dot(t2, Mt2_a) - u2 * u2) * over_a + (dot(t2, Mt2_b) - v2 * v2) * over_b;
        const Lanes r1 = dot(t1, G), r2 = dot(t2, G);
        const Lanes scale = h11 + h22 + absolute(s.f) + all(kTiny);
        const Step2 x = newton_step(h11 + s.f, h12, h22 + s.f, r1, r2, scale);
        V3 newton = x.x1 * t1 + x.x2 * t2;
        const Lanes length = root(dot(newton, newton));
        newton = (all(1) / larger(length, all(1))) * newton;  // 45 degrees at most

        const Sample from = s;
        LaneMask searching = climbing;
        search(g, newton, from, 1, s, searching);
        const LaneMask promising = x.promised > all(kGainTolerance) * (from.h_a + from.h_b);
        climbing = climbing & promising;  // else that was the last step
        searching = searching & promising;
        if (!any(searching)) continue;
        search(g, all(0.35) * newton, from, kBacktracks, s, searching);
        if (any(searching)) search(g, (all(1) / scale) * (r1 * t1 + r2 * t2), from, kBacktracks, s, searching);
        climbing = climbing & ~searching;  // nothing rises
    }
    return s;
}

SUNDER_INLINE Gap load_gap(const FourEllipsoidPairs& p) { return {load3(p.d), load_sym(p.M_a), load_sym(p.M_b)}; }

SUNDER_INLINE void store_sample(const Sample& s, FourEllipsoidPairs& o_pairs) {
    store3(o_pairs.n, s.n), store3(o_pairs.s_a, s.s_a), store3(o_pairs.s_b, s.s_b);
    store(o_pairs.f, s.f);
    store(o_pairs.depth, -s.f / (s.h_a + s.h_b));
}

void from_centres(FourEllipsoidPairs* blocks, size_t n_blocks) {
    for (size_t k = 0; k < n_blocks; ++k) {
        const Gap g = load_gap(blocks[k]);
        const Lanes length = root(dot(g.d, g.d));
        const LaneMask apart = (length > all(0)) & (length < all(kInfinity));
        const V3 first = {select<Lanes>(apart, g.d.x, all(0)), select<Lanes>(apart, g.d.y, all(0)),
                          select<Lanes>(apart, g.d.z, all(1))};
        Sample s = ascend(g, (all(1) / select<Lanes>(apart, length, all(1))) * first);
        s.f = select<Lanes>(apart, s.f, all(-kInfinity));
        store_sample(s, blocks[k]);
    }
}

void from_candidates(FourEllipsoidPairs* blocks, size_t n_blocks) {
    constexpr int kClimbs = 3;
    for (size_t k = 0; k < n_blocks; ++k) {
        FourEllipsoidPairs& p = blocks[k];
        const Gap g = load_gap(p);
        V3 start[kClimbs];
        Lanes value[kClimbs];
        for (int c = 0; c < kClimbs; ++c) start[c] = load3(p.candidates[0]), value[c] = all(-kInfinity);
        for (const auto& candidate : p.candidates) {
            V3 n = load3(candidate);
            n = select<Lanes>(dot(n, g.d) < all(0), all(-1), all(1)) * n;  // to the side of a
            const Lanes f = sample_at(g, n).f;
            LaneMask above = f > value[kClimbs - 1];
            start[kClimbs - 1] = select3(above, n, start[kClimbs - 1]);
            value[kClimbs - 1] = select<Lanes>(above, f, value[kClimbs - 1]);
            for (int c = kClimbs - 1; c > 0; --c) {
                above = value[c] > value[c - 1];
                const V3 lower = select3(above, start[c - 1], start[c]);
                const Lanes less = select<Lanes>(above, value[c - 1], value[c]);
                start[c - 1] = select3(above, start[c], start[c - 1]);
                value[c - 1] = select<Lanes>(above, value[c], value[c - 1]);
                start[c] = lower, value[c] = less;
            }
        }
        Sample best;
        best.n = load3(p.n), best.s_a = load3(p.s_a), best.s_b = load3(p.s_b), best.f = load<Lanes>(p.f);
        best.h_a = best.h_b = all(1);  // its depth is known
        for (int c = 0; c < kClimbs; ++c) {
            const Sample s = ascend(g, start[c]);
            best = select_sample(s.f > best.f, s, best);
        }
        store_sample(best, p);
    }
}

}  // namespace

const AscentKernels SUNDER_KERNELS(kAscentKernels) = {from_centres, from_candidates};

}  // namespace sunder
