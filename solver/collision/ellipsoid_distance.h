// How far apart two ellipsoids are, or how deep they overlap.
#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "solver/collision/contact.h"
#include "solver/data/math.h"

namespace sunder {

/// Where two solids a and b are nearest, or deepest in one another.
struct Separation {
    Vec3 normal = Vec3::UnitZ();  // unit, from b towards a
    Vec3 point_a = Vec3::Zero();  // deepest point of a towards b, world, m
    Vec3 point_b = Vec3::Zero();  // deepest point of b towards a, world, m
    double gap = 0;               // normal . (point_a - point_b), m; negative: overlap
};

/// The same seen from the other solid: bit for bit, with the normal negated.
inline Separation flipped(const Separation& s) { return {-s.normal, s.point_b, s.point_a, s.gap}; }

/// Gap of two ellipsoids along their best separating direction; minus the least translation that parts them if they
/// overlap. The gap is never above the true one by more than rounding, whatever the aspect ratio (numerics in
/// ascent_kernels.cpp). Swapping a and b gives the same bits, flipped. Always finite; with coinciding centres the
/// normal is a direction in which both are thin. Needs finite centres, unit axes, radii > 0.
Separation ellipsoid_distance(const Ellipsoid& a, const Ellipsoid& b);

/// The same for many pairs (a, b) of `ellipsoids`, at less than half the cost each; writes out (n_pairs). `support`:
/// their matrices R diag(r^2) R^T (n_ellipsoids), m2, or empty.
void ellipsoid_distances(const ParticleEllipsoids& ellipsoids, std::span<const Sym3> support,
                         std::span<const std::pair<uint32_t, uint32_t>> pairs, std::span<Separation> out);

}  // namespace sunder
