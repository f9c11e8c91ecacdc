// Which fragments and interfaces are tougher, weaker, softer or heavier than the rest of their body.
#pragma once

#include <string>

#include "solver/data/fragment_set.h"
#include "solver/data/result.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

/// Factors are held to this range. Glue is infinite.
constexpr double kLeastFactor = 1e-3, kMostFactor = 1e3;

/// Names of numbers painted on the mesh that is cut: a vertex attribute, or "red", "green", "blue", "alpha" of its
/// colours; empty: none. The painted number is the factor.
struct PaintedMaps {
    std::string toughness, yield, density;
};

/// Multiplies the fragments' factors by what is painted on `source`. A fragment with a part of the surface takes the
/// mean over it, by area; one within takes what is painted where the surface is nearest. Numbers outside of the range
/// of factors are moved into it, which a warning of the set tells. Errors: a map that the mesh has not (those that it
/// has are named).
Status apply_maps(const TriMesh& source, const PaintedMaps& maps, const std::string& where, FragmentSet& io_set);

/// Gathers fragments into `count` clusters of like size (k-means on their centroids, by volume), each hanging together
/// by interfaces, and multiplies the toughness of interfaces within one by `toughness_factor`. With fewer fragments
/// than clusters, and where the solid has more separate parts, the number differs. Deterministic for one `seed`.
void gather_clusters(int count, double toughness_factor, uint64_t seed, FragmentSet& io_set);

/// Interfaces of less than `least_share` (V_a V_b)^(1/3) of area, V the volumes of the two fragments, no longer hold
/// them together, unless nothing else joins the two sides then. They stay in the table, and part with what is around
/// them.
void leave_out_weak_interfaces(double least_share, FragmentSet& io_set);

/// Factors for part of a body.
struct RegionFactors {
    double toughness = 1, yield = 1, density = 1;  // on the fragments in it
    double interface_toughness = 1;                // on the interfaces within it; infinite: glued
};

/// `inside[i]`: whether fragment i is in the region. Interfaces between two of them are within it.
void apply_region(const std::vector<uint8_t>& inside, const RegionFactors& factors, FragmentSet& io_set);

}  // namespace sunder
