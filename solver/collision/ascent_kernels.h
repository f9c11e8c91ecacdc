// The best separating directions of pairs of ellipsoids, four pairs at a time (numerics in ascent_kernels.cpp).
#pragma once

#include <cstddef>

namespace sunder {

/// Four pairs side by side. Lanes without a pair hold anything that is finite, with M positive definite.
struct alignas(64) FourEllipsoidPairs {
    double d[3][4];               // center_a - center_b, m
    double M_a[6][4], M_b[6][4];  // R diag(r^2) R^T as Sym3 (xx, yy, zz, xy, xz, yz), m2
    double candidates[6][3][4];   // further directions to start from where f may have several maxima
    double n[3][4];               // result: from b to a, unit
    double s_a[3][4], s_b[3][4];  // result: support points along n, from the centres, m
    double f[4];                  // result: the gap, m
    double depth[4];              // result: overlap as a share of the support values
};

struct AscentKernels {
    /// From the line of centres. Where centres coincide, f = -infinity and depth = infinity.
    void (*from_centres)(FourEllipsoidPairs*, size_t n_blocks);
    /// From the best three of the candidates; keeps the result that is there where it is no less.
    void (*from_candidates)(FourEllipsoidPairs*, size_t n_blocks);
};

extern const AscentKernels kAscentKernelsPortable, kAscentKernelsAvx2, kAscentKernelsAvx512;

}  // namespace sunder
