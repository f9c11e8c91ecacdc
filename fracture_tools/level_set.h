// Meshes as signed distance grids (OpenVDB), for colliders.
#pragma once

#include <string>
#include <vector>

#include "solver/data/result.h"
#include "solver/data/signed_distance_grid.h"
#include "solver/data/tri_mesh.h"

namespace sunder {

struct LevelSetSettings {
    double voxel_size = 0;  // m; 0: the mesh's longest side / resolution
    int resolution = 100;   // voxels along the longest side, 8 .. 1000
    double thickness = 0;   // m; > 0: not what the surface bounds, but what is within half of this of it (open sheets)

    Status check(const std::string& where) const;  // ranges
};

/// Memory that a grid may take. Building it takes several times as much for a while.
constexpr size_t kMostLevelSetBytes = size_t(256) << 20;

/// The distance to the mesh at the nodes of a grid: right to single precision within a voxel of the surface, to a few
/// hundredths of a voxel within six; farther away interpolated between 24 nodes along the longest side, so that it is
/// right to two voxels, but up to 5 % of that side too short where the surface is equally far all round. Insides of
/// shells that face inwards are outside.
///
/// A mesh that bounds no solid is mended first, as for a cut, which `io_warnings` tells; so is detail that the voxels
/// lose. Errors: no triangles, coordinates that are not finite, a surface that stays open (unless it is given a
/// thickness), one whose inside cannot be told (winding numbers say otherwise), a grid above kMostLevelSetBytes (the
/// voxel size that fits is named), nothing thicker than a voxel. Same mesh and settings, same bits.
Result<SignedDistanceGrid> make_level_set(const TriMesh& mesh, const LevelSetSettings& settings,
                                          const std::string& where, std::vector<std::string>& io_warnings);

/// Volume of the inside, m3; to second order in the voxel size where the surface is smooth.
double level_set_volume(const SignedDistanceGrid& grid);

}  // namespace sunder
