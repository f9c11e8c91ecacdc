// The distance to a closed surface, known at the nodes of a regular grid: what a mesh collider is asked.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "solver/data/math.h"

namespace sunder {

/// Nodes hold the bounds of the surface with at least two voxels to spare, so that all on the border are outside.
struct SignedDistanceGrid {
    std::array<uint32_t, 3> nodes = {0, 0, 0};  // along x, y, z; >= 2
    Vec3 origin = Vec3::Zero();                 // node (0, 0, 0), m
    double voxel_size = 0;                      // between nodes, m
    Aabb bounds;                                // of the surface, m
    std::vector<float> distance;                // (nx, ny, nz), z fastest, m; negative inside
    uint64_t key = 0;                           // equal for grids made of equal meshes and settings

    size_t index(size_t i, size_t j, size_t k) const { return (i * nodes[1] + j) * nodes[2] + k; }
    Vec3 node(size_t i, size_t j, size_t k) const {
        return origin + voxel_size * Vec3(double(i), double(j), double(k));
    }
};

}  // namespace sunder
