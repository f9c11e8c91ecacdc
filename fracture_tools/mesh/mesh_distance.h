// Distance to a triangle mesh at the nodes of a grid, by OpenVDB.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "solver/data/tri_mesh.h"

namespace sunder {

/// A grid's nodes (0, 0, 0) .. nodes - 1; the first at `origin`, `voxel_size` (m) between them.
struct GridNodes {
    std::array<uint32_t, 3> nodes;
    Vec3 origin;
    double voxel_size;
};

/// Distances in voxels, z fastest, negative inside. Those up to `band` are right to a few hundredths of a voxel (to
/// rounding within one voxel, in the mean elsewhere; but see trim in level_set.cpp); farther ones are `band`. Inside is
/// what cannot be reached from outside without crossing the surface, whatever way its faces look: an open surface has
/// none, shells within it none of their own. The same bits for any number of threads. Throws what OpenVDB throws.
std::vector<float> signed_distances(const MeshView& mesh, const GridNodes& grid, float band);

/// The same without an inside, and without sign.
std::vector<float> unsigned_distances(const MeshView& mesh, const GridNodes& grid, float band);

}  // namespace sunder
